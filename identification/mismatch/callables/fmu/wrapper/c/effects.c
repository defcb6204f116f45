#include "effects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What numba passes for an array: owner, parent, items, bytes of one, address, shape, strides. */
#define CUBE_TYPES \
    void *, void *, int64_t, int64_t, double *, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t
#define CUBE(a, l, m, n) NULL, NULL, (l) * (m) * (n), 8, a, l, m, n, 8 * (m) * (n), 8 * (n), 8

int32_t slipbench_at(double *value, void **exception, int64_t place, double, double own,
                     double fraction, double elapsed, int64_t when, Board *board, CUBE_TYPES,
                     CUBE_TYPES, int64_t count, double step);

_Static_assert(sizeof(Board) == BOARD_BYTES, "the layout of the record is another one");

static int own_states(const Group *g) { return OWN_STATES * g->effects; }
static int first_value(const Group *g) { return 1 + g->values + g->rates; }

void acting_free(Acting *a) {
    free(a->rings);
    a->rings = NULL;
}

void acting_reset(Acting *a, const Group *g) {
    acting_free(a);
    memset(a, 0, sizeof *a);
    a->group = g;
    a->board.effects = g->effects;
    a->board.states = g->rates;
    a->board.first_state = first_value(g) + g->values;
    for (int k = 0; k < g->effects; k++) {
        a->board.code[k] = g->code[k];
        a->board.where[k] = g->where[k];
        a->board.other[k] = g->other[k];
        memcpy(a->board.par[k], g->par + MOST_PARAMETERS * k, sizeof a->board.par[k]);
    }
}

int acting_begin(Acting *a, double step) {
    double longest = 0.0;
    for (int k = 0; k < a->group->effects; k++)
        if (a->group->delay_at[k] >= 0)
            longest = fmax(longest, a->board.par[k][a->group->delay_at[k]]);
    if (!(longest / step < MOST_RING)) return -1;
    a->ring = 4;
    while (a->ring < (int64_t)(longest / step) + 4) a->ring *= 2;
    free(a->rings);
    a->rings = calloc(2 * (size_t)a->group->effects * a->ring + 1, sizeof(double));
    a->count = 0;
    return a->rings ? 0 : -1;
}

static double act(Acting *a, int64_t place, double value, double own, Moment m) {
    void *exception = NULL;
    double found = value;
    int64_t n = a->group->effects;
    slipbench_at(&found, &exception, place, value, own, m.fraction, m.elapsed, m.when, &a->board,
                 CUBE(a->tables, n, 2, 1), CUBE(a->rings, n, 2, a->ring), m.count, m.step);
    return found;
}

/* Values of all places that are told, with what acts there; the effects' rates in dx. */
static void evaluate(Acting *a, const double *values, Moment m, double *shown) {
    const Group *g = a->group;
    double *q = a->board.q + first_value(g);
    memcpy(q, values, g->values * sizeof(double));
    for (int k = 0; k < g->shown; k++) {
        shown[k] = act(a, g->place[k], q[g->source[k]], 0.0, m);
        if (g->kept) q[g->source[k]] = shown[k];
    }
}

void acting_at_rest(Acting *a, const double *values, double *shown) {
    Moment m = {0, 0.0, 0.0, 1.0, FIRST};
    evaluate(a, values, m, shown);
}

/* The classical Runge-Kutta rule, with the effects' memories brought up to date at a row's ends. */
void acting_row(Acting *a, const double *before, const double *now, const char *held, int substeps,
                double step, int64_t row, double *shown) {
    const Group *g = a->group;
    int states = own_states(g);
    double values[MOST_VALUES], *stage = a->board.x, *dx = a->board.dx;
    memcpy(stage, a->x, states * sizeof(double));
    for (int turn = 0; turn <= 4 * substeps; turn++) {
        int s = turn / 4, part = turn % 4, ends = turn == 4 * substeps;
        double fraction = part == 0 ? 0.0 : part == 3 ? 1.0 : 0.5;
        if (ends) s = substeps - 1, fraction = 1.0;
        Moment m = {a->count, fraction, fraction * step, step, WITHIN};
        if (ends)
            m.when = END;
        else if (part == 0 && s > 0)
            m.when = STEP_BEGINS, m.elapsed = step;
        else if (part == 0)
            m.when = row > 0 ? ROW : FIRST;
        for (int k = 0; k < g->values; k++) {
            double line = before[k] + (now[k] - before[k]) * (s + fraction) / substeps;
            values[k] = held[k] ? now[k] : line;
        }
        a->board.q[0] = (row * substeps + s + fraction) * step;
        evaluate(a, values, m, shown);
        if (ends) break;
        if (m.when == FIRST) memcpy(a->x, stage, states * sizeof(double));
        double weight = part == 0 || part == 3 ? 1.0 : 2.0, ahead = part == 2 ? step : 0.5 * step;
        for (int i = 0; i < states; i++) {
            a->total[i] = weight * dx[i] + (part == 0 ? 0.0 : a->total[i]);
            if (part == 3) a->x[i] += step / 6.0 * a->total[i];
            stage[i] = a->x[i] + (part == 3 ? 0.0 : ahead * dx[i]);
        }
        if (part == 3 && s < substeps - 1) a->count++;
    }
    a->count++;
}

void acting_rates(Acting *a, Moment m, const double *inputs, int count, const double *states,
                  const double *own, double *rates, double *own_rates) {
    const Group *g = a->group;
    Board *b = &a->board;
    int more = own_states(g);
    double *q = b->q + first_value(g);
    memcpy(q, inputs, count * sizeof(double));
    memcpy(q + count, states, g->rates * sizeof(double));
    memcpy(b->x, states, g->rates * sizeof(double));
    memcpy(b->x + g->rates, own, more * sizeof(double));
    memset(b->spill, 0, g->rates * sizeof(double));
    memset(b->dx, 0, (g->rates + more) * sizeof(double));
    for (int k = 0; k < g->shown; k++) {
        int state = g->place[k] - count;
        rates[state] = act(a, g->place[k], rates[state], states[state], m);
    }
    if (m.when == FIRST) memcpy(a->x, b->x + g->rates, more * sizeof(double));
    for (int k = 0; k < g->rates; k++) rates[k] += b->spill[k];
    memcpy(own_rates, b->dx + g->rates, more * sizeof(double));
}

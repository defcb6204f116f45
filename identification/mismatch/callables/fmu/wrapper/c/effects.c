#include "effects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What numba passes for an array: owner, parent, items, bytes of one, address, shape, strides. */
#define LINE_TYPES(type) void *, void *, int64_t, int64_t, type *, int64_t, int64_t
#define TABLE_TYPES void *, void *, int64_t, int64_t, double *, int64_t, int64_t, int64_t, int64_t
#define CUBE_TYPES \
    void *, void *, int64_t, int64_t, double *, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t
#define LINE(a, n) NULL, NULL, n, 8, a, n, 8
#define TABLE(a, m, n) NULL, NULL, (m) * (n), 8, a, m, n, 8 * (n), 8
#define CUBE(a, l, m, n) NULL, NULL, (l) * (m) * (n), 8, a, l, m, n, 8 * (m) * (n), 8 * (n), 8

int32_t slipbench_at(double *value, void **exception, int64_t place, double, double own,
                     double fraction, double elapsed, int64_t when, LINE_TYPES(double),
                     LINE_TYPES(double), LINE_TYPES(const int64_t), LINE_TYPES(const int64_t),
                     LINE_TYPES(const int64_t), TABLE_TYPES, CUBE_TYPES, LINE_TYPES(double),
                     LINE_TYPES(double), TABLE_TYPES, CUBE_TYPES, int64_t count, double step);

static int own_states(const Group *g) { return MOST_STATES * g->effects; }
static int first_value(const Group *g) { return 1 + g->values + g->rates; }

static double *zeros(size_t count) { return calloc(count ? count : 1, sizeof(double)); }

void acting_free(Acting *a) {
    double *all[] = {a->par, a->x,     a->dx,     a->total, a->last,
                     a->q,   a->spill, a->memory, a->rings, a->tables};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) free(all[k]);
    memset(a, 0, sizeof *a);
}

int acting_reset(Acting *a, const Group *g) {
    size_t n = g->effects, all = g->rates + own_states(g);
    acting_free(a);
    a->group = g;
    a->par = zeros(n * MOST_PARAMETERS);
    a->x = zeros(all);
    a->dx = zeros(all);
    a->total = zeros(all);
    a->last = zeros(all);
    a->memory = zeros(n * MOST_MEMORIES);
    a->tables = zeros(n * 2);
    a->q = zeros(first_value(g) + g->values + g->rates);
    a->spill = zeros(g->rates);
    if (!a->par || !a->x || !a->dx || !a->total || !a->last || !a->memory || !a->tables || !a->q ||
        !a->spill)
        return -1;
    if (n) memcpy(a->par, g->par, n * MOST_PARAMETERS * sizeof(double));
    return 0;
}

int acting_begin(Acting *a, double step) {
    double longest = 0.0;
    for (int k = 0; k < a->group->effects; k++)
        if (a->group->delay_at[k] >= 0)
            longest = fmax(longest, a->par[MOST_PARAMETERS * k + a->group->delay_at[k]]);
    if (!(longest / step < MOST_RING)) return -1;
    a->ring = 4;
    while (a->ring < (int64_t)(longest / step) + 4) a->ring *= 2;
    free(a->rings);
    a->rings = zeros(2 * (size_t)a->group->effects * a->ring);
    a->count = 0;
    return a->rings ? 0 : -1;
}

static double act(Acting *a, int64_t place, double value, double own, Moment m, double *x) {
    const Group *g = a->group;
    void *exception = NULL;
    double found = value;
    int64_t n = g->effects, all = g->rates + own_states(g);
    int64_t quantities = first_value(g) + g->values + g->rates;
    slipbench_at(&found, &exception, place, value, own, m.fraction, m.elapsed, m.when, LINE(x, all),
                 LINE(a->dx, all), LINE(g->code, n), LINE(g->where, n), LINE(g->other, n),
                 TABLE(a->par, n, MOST_PARAMETERS), CUBE(a->tables, n, 2, 1), LINE(a->q, quantities),
                 LINE(a->spill, g->rates), TABLE(a->memory, n, MOST_MEMORIES),
                 CUBE(a->rings, n, 2, a->ring), m.count, m.step);
    return found;
}

/* Values of all places that are told, with what acts there; the effects' rates in dx. */
static void evaluate(Acting *a, const double *values, Moment m, double *x, double *shown) {
    const Group *g = a->group;
    double *q = a->q + first_value(g);
    memcpy(q, values, g->values * sizeof(double));
    for (int k = 0; k < g->shown; k++) {
        shown[k] = act(a, g->place[k], q[g->source[k]], 0.0, m, x);
        if (g->kept) q[g->source[k]] = shown[k];
    }
}

void acting_at_rest(Acting *a, const double *values, double *shown) {
    Moment m = {0, 0.0, 0.0, 1.0, FIRST};
    evaluate(a, values, m, a->x, shown);
}

/* The classical Runge-Kutta rule, with the effects' memories brought up to date at a row's ends. */
void acting_row(Acting *a, const double *before, const double *now, const char *held, int substeps,
                double step, int64_t row, double *shown) {
    const Group *g = a->group;
    int states = own_states(g);
    double values[MOST_VALUES], *stage = a->last;
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
        a->q[0] = (row * substeps + s + fraction) * step;
        evaluate(a, values, m, stage, shown);
        if (ends) break;
        if (m.when == FIRST) memcpy(a->x, stage, states * sizeof(double));
        double weight = part == 0 || part == 3 ? 1.0 : 2.0, ahead = part == 2 ? step : 0.5 * step;
        for (int i = 0; i < states; i++) {
            a->total[i] = weight * a->dx[i] + (part == 0 ? 0.0 : a->total[i]);
            if (part == 3) a->x[i] += step / 6.0 * a->total[i];
            stage[i] = a->x[i] + (part == 3 ? 0.0 : ahead * a->dx[i]);
        }
        if (part == 3 && s < substeps - 1) a->count++;
    }
    a->count++;
}

void acting_rates(Acting *a, Moment m, const double *inputs, int count, const double *states,
                  const double *own, double *rates, double *own_rates) {
    const Group *g = a->group;
    int more = own_states(g);
    double *q = a->q + first_value(g), x[MOST_VALUES + 1];
    memcpy(q, inputs, count * sizeof(double));
    memcpy(q + count, states, g->rates * sizeof(double));
    memcpy(x, states, g->rates * sizeof(double));
    memcpy(x + g->rates, own, more * sizeof(double));
    memset(a->spill, 0, g->rates * sizeof(double));
    memset(a->dx, 0, (g->rates + more) * sizeof(double));
    for (int k = 0; k < g->shown; k++) {
        int state = g->place[k] - count;
        rates[state] = act(a, g->place[k], rates[state], states[state], m, x);
    }
    if (m.when == FIRST) memcpy(a->x, x + g->rates, more * sizeof(double));
    for (int k = 0; k < g->rates; k++) rates[k] += a->spill[k];
    memcpy(own_rates, a->dx + g->rates, more * sizeof(double));
}

#include "motorcycle.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* What numba passes for an array: owner, parent, items, bytes of one, address, shape, strides. */
#define ARRAY_TYPES(type) void *, void *, int64_t, int64_t, type *, int64_t, int64_t
#define TABLE_TYPES void *, void *, int64_t, int64_t, double *, int64_t, int64_t, int64_t, int64_t
#define ARRAY(a, n) NULL, NULL, n, 8, a, n, 8
#define TABLE(a, columns) NULL, NULL, columns, 8, a, 1, columns, 8 * (columns), 8

int32_t slipbench_run(void *result, void **exception, ARRAY_TYPES(double), TABLE_TYPES,
                      ARRAY_TYPES(double), ARRAY_TYPES(double), double step, int64_t steps,
                      int64_t states, ARRAY_TYPES(double), ARRAY_TYPES(int64_t), TABLE_TYPES,
                      ARRAY_TYPES(double));

static const Variable VARIABLE[] = {VARIABLES};
static const double START_PARAMETERS[] = {PARAMETER_STARTS};
static const double START_ROW[] = {ROW_STARTS};
static const uint32_t COUNT = sizeof VARIABLE / sizeof VARIABLE[0];

static int failed(Motorcycle *m, const char *what, const char *name, double value) {
    snprintf(m->message, sizeof m->message, what, name, value);
    return -1;
}

/* Address of a variable's value; NULL: no such reference. */
static double *place(Numbers *n, uint32_t reference) {
    if (reference < 1 || reference > COUNT) return NULL;
    const Variable *v = &VARIABLE[reference - 1];
    switch (v->kind) {
        case INPUT: return &n->row[v->index];
        case PARAMETER: return &n->parameters[v->index];
        case RATIO: return &n->ratios[v->index];
        case INITIAL: return &n->initial[v->index];
        default: return &n->out[v->index];
    }
}

void motorcycle_reset(Motorcycle *m) {
    memset(m, 0, sizeof *m);
    memcpy(m->numbers.parameters, START_PARAMETERS, sizeof START_PARAMETERS);
    memcpy(m->numbers.row, START_ROW, sizeof START_ROW);
    for (uint32_t k = 1; k <= COUNT; k++) *place(&m->numbers, k) = VARIABLE[k - 1].start;
}

int motorcycle_set(Motorcycle *m, uint32_t reference, double value) {
    double *there = place(&m->numbers, reference);
    if (there == NULL) return failed(m, "%sno variable has value reference %.0f", "", reference);
    const Variable *v = &VARIABLE[reference - 1];
    if (v->kind == OUTPUT) return failed(m, "%s is an output: it cannot be set", v->name, value);
    if (v->kind != INPUT && m->numbers.phase == STEPPING)
        return failed(m, "%s can be set only before the end of initialization", v->name, value);
    if (isnan(value)) return failed(m, "%s = NaN: a number is expected", v->name, value);
    if (value < v->low || value > v->high) {
        snprintf(m->message, sizeof m->message, "%s = %g is outside of %g to %g", v->name, value,
                 v->low, v->high);
        return -1;
    }
    if (v->whole && value != floor(value))
        return failed(m, "%s = %g: a whole number is expected", v->name, value);
    *there = value;
    return 0;
}

int motorcycle_get(Motorcycle *m, uint32_t reference, double *value) {
    const double *there = place(&m->numbers, reference);
    if (there == NULL) return failed(m, "%sno variable has value reference %.0f", "", reference);
    *value = *there;
    return 0;
}

static void run(Numbers *n, int64_t steps) {
    void *result = NULL, *exception = NULL;
    double unused[OUTPUTS];
    int64_t shown[OUTPUTS];
    for (int k = 0; k < OUTPUTS; k++) shown[k] = k;
    slipbench_run(&result, &exception, ARRAY(n->state, SIZE), TABLE(n->row, INPUTS),
                  ARRAY(n->parameters, PARAMETERS), ARRAY(n->ratios, RATIOS), STEP, steps, STATES,
                  ARRAY(n->delays, 2), ARRAY(shown, OUTPUTS), TABLE(unused, OUTPUTS),
                  ARRAY(n->out, OUTPUTS));
}

static int finite(Motorcycle *m) {
    for (uint32_t k = 0; k < COUNT; k++)
        if (VARIABLE[k].kind == OUTPUT && !isfinite(m->numbers.out[VARIABLE[k].index]))
            return failed(m, "%s is not finite at %g s: these parameters are unstable",
                          VARIABLE[k].name, motorcycle_time(m));
    return 0;
}

int motorcycle_initialize(Motorcycle *m) {
    Numbers *n = &m->numbers;
    double past[RINGS] = {n->initial[0], n->initial[1], n->row[THROTTLE_COMMAND], n->row[SPARK]};
    n->delays[0] = n->parameters[COMMAND_DELAY] / STEP;
    n->delays[1] = n->parameters[SPARK_DELAY] / STEP;
    n->state[0] = 0.0;
    memcpy(n->state + HEADER, n->initial, sizeof n->initial);
    double *ring = n->state + HEADER + STATES;
    for (int r = 0; r < RINGS; r++)
        for (int k = 0; k < RING; k++) *ring++ = past[r];
    run(n, 0);
    n->phase = STEPPING;
    return finite(m);
}

int motorcycle_step(Motorcycle *m, double time, double step) {
    double steps = step / STEP, whole = round(steps);
    if (fabs(time - motorcycle_time(m)) > 0.5 * STEP)
        return failed(m, "%sa step from %.9g s is not where the last one ended", "", time);
    if (!(whole >= 0.0) || fabs(steps - whole) > 1e-6 * fmax(whole, 1.0))
        return failed(m, "%sa step of %.9g s is no multiple of the internal step, " STEP_TEXT, "",
                      step);
    if (whole > 0.0) run(&m->numbers, (int64_t)whole);
    return finite(m);
}

double motorcycle_time(const Motorcycle *m) { return m->numbers.begin + m->numbers.state[0] * STEP; }

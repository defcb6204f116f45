/* Effects on the signals around an FMU, row by row, as the kernel of model files moves them.

   A row is one step of communication. tables.h is generated for each FMU. */
#ifndef EFFECTS_H
#define EFFECTS_H

#include <stdint.h>

#include "tables.h"

/* When effects are evaluated: within a step, at the beginning of all, of a row, of a later step of the
   same row, and at a row's end. */
enum When { WITHIN, FIRST, ROW, STEP_BEGINS, END };

/* Effects that act together. values: quantities that they may use; rates: of states on which they act.
   shown: places that are told, each from the quantity source[k]; kept: it takes the acted value. */
typedef struct {
    int effects, values, rates, shown, kept;
    const int64_t *code, *where, *other, *delay_at;
    const double *par;
    const int *place, *source;
} Group;

/* What one group remembers. */
typedef struct {
    const Group *group;
    double *par, *x, *dx, *total, *last, *memory, *rings, *tables, *q, *spill;
    int64_t ring, count;
} Acting;

int acting_reset(Acting *a, const Group *group); /* 0, or -1: no memory */
int acting_begin(Acting *a, double step);        /* before the first row */
void acting_free(Acting *a);

/* Values of a group before any row, in `shown`. */
void acting_at_rest(Acting *a, const double *values, double *shown);

/* One row. before, now: quantities at its begin and end, (values,); a held one has its last value
   throughout. row: its number; shown: (shown,), at its end. */
void acting_row(Acting *a, const double *before, const double *now, const char *held, int substeps,
                double step, int64_t row, double *shown);

/* One stage of a Runge-Kutta step: adds to the rates, (rates,), what acts on them. */
typedef struct {
    int64_t count;
    double fraction, elapsed, step;
    enum When when;
} Moment;
void acting_rates(Acting *a, Moment m, const double *inputs, int count, const double *states,
                  const double *own, double *rates, double *own_rates);

#endif

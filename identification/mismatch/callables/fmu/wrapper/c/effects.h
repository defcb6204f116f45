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

/* The record of the compiled effects: systems/board.py gives its layout. */
typedef struct {
    int64_t effects, states, first_state;
    int64_t code[MOST_EFFECTS], where[MOST_EFFECTS], other[MOST_EFFECTS];
    double par[MOST_EFFECTS][MOST_PARAMETERS], memory[MOST_EFFECTS][MOST_MEMORIES];
    double x[ALL_STATES], dx[ALL_STATES], q[MOST_QUANTITIES], spill[MOST_STATES];
} Board;

/* What one group remembers. x: states of its effects at the begin of a step. */
typedef struct {
    const Group *group;
    Board board;
    double x[ALL_STATES], total[ALL_STATES], *rings, tables[2 * MOST_EFFECTS];
    int64_t ring, count;
} Acting;

void acting_reset(Acting *a, const Group *group);
int acting_begin(Acting *a, double step); /* before the first row; 0, or -1: no memory */
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

#define _GNU_SOURCE
#include "wrapper.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int64_t INPUT_CODE[] = {INPUT_CODES}, INPUT_WHERE[] = {INPUT_PLACES},
                     INPUT_OTHER[] = {INPUT_OTHERS}, INPUT_DELAY[] = {INPUT_DELAYS},
                     RATE_CODE[] = {RATE_CODES}, RATE_WHERE[] = {RATE_PLACES},
                     RATE_OTHER[] = {RATE_OTHERS}, RATE_DELAY[] = {RATE_DELAYS},
                     OUTPUT_CODE[] = {OUTPUT_CODES}, OUTPUT_WHERE[] = {OUTPUT_PLACES},
                     OUTPUT_OTHER[] = {OUTPUT_OTHERS}, OUTPUT_DELAY[] = {OUTPUT_DELAYS};
static const double INPUT_PAR[] = {INPUT_SIZES}, RATE_PAR[] = {RATE_SIZES},
                    OUTPUT_PAR[] = {OUTPUT_SIZES};
static const int INPUT_SHOWN[] = {INPUT_TOLD}, RATE_SHOWN[] = {RATE_TOLD},
                 OUTPUT_SHOWN[] = {OUTPUT_TOLD}, OUTPUT_SOURCE[] = {OUTPUT_SOURCES};
static const Group INPUT_GROUP = {INPUT_EFFECTS, INPUTS + SHOWN, 0,           INPUTS,    1,
                                  INPUT_CODE,    INPUT_WHERE,    INPUT_OTHER, INPUT_DELAY,
                                  INPUT_PAR,     INPUT_SHOWN,    INPUT_SHOWN},
                   RATE_GROUP = {RATE_EFFECTS, INPUTS,     NAMED_STATES, RATES_ACTED, 0,
                                 RATE_CODE,    RATE_WHERE, RATE_OTHER,   RATE_DELAY,
                                 RATE_PAR,     RATE_SHOWN, RATE_SHOWN},
                   OUTPUT_GROUP = {OUTPUT_EFFECTS, INPUTS + SHOWN, 0,            OUTPUTS,     0,
                                   OUTPUT_CODE,    OUTPUT_WHERE,   OUTPUT_OTHER, OUTPUT_DELAY,
                                   OUTPUT_PAR,     OUTPUT_SHOWN,   OUTPUT_SOURCE};
static const Port INPUT[] = {INPUT_PORTS}, OUTPUT[] = {OUTPUT_PORTS}, STATE[] = {STATE_PORTS};
static const int STATE_INDEX[] = {STATE_INDICES};
static const Size SIZE[] = {EFFECT_PARAMETERS};
static const double INPUT_START[] = {INPUT_STARTS}, LATE[] = {LATE_STARTS},
                    CALIBRATED[] = {CALIBRATED_VALUES};
static const uint32_t CALIBRATED_AT[] = {CALIBRATED_REFERENCES};
static const double WEIGHT[] = {1.0, 2.0, 2.0, 1.0}, SHARE[] = {0.0, 0.5, 0.5, 1.0};

int wrapper_failed(Wrapper *w, const char *what, double value) {
    if (w->message[0] == '\0') snprintf(w->message, sizeof w->message, what, value);
    return -1;
}

void wrapper_free(Wrapper *w) {
    acting_free(&w->inputs);
    acting_free(&w->rates);
    acting_free(&w->outputs);
    free(w->history);
    free(w->x);
    free(w->z);
    free(w->work);
    w->history = w->x = w->z = w->work = NULL;
}

void wrapper_reset(Wrapper *w) {
    wrapper_free(w);
    w->phase = INSTANTIATED;
    w->row = w->kept = 0;
    w->step = w->begin = 0.0;
    w->next_event = INFINITY;
    w->message[0] = '\0';
    memcpy(w->set, INPUT_START, INPUTS * sizeof(double));
    memcpy(w->late, LATE, OUTPUTS * sizeof(double));
    acting_reset(&w->inputs, &INPUT_GROUP);
    acting_reset(&w->rates, &RATE_GROUP);
    acting_reset(&w->outputs, &OUTPUT_GROUP);
}

int wrapper_configure(Wrapper *w) {
    return inner_set(w->inner, CALIBRATED_AT, CALIBRATED_COUNT, CALIBRATED);
}

/* Variables. */

static double *size_of(Wrapper *w, const Size *s) {
    switch (s->group) {
        case INPUT_SIDE: return &w->inputs.board.par[0][s->index];
        case RATE_SIDE: return &w->rates.board.par[0][s->index];
        case OUTPUT_SIDE: return &w->outputs.board.par[0][s->index];
        default: return &w->late[s->index];
    }
}

int wrapper_set(Wrapper *w, uint32_t reference, double value, int *own) {
    *own = 1;
    for (int k = 0; k < INPUTS; k++)
        if (INPUT[k].reference == reference) {
            w->set[k] = (value - INPUT[k].offset) / INPUT[k].slope;
            return 0;
        }
    for (int k = 0; k < EFFECT_PARAMETER_COUNT; k++)
        if (SIZE[k].reference == reference) {
            w->message[0] = '\0';
            if (w->phase == STEPPING)
                return wrapper_failed(w, "a parameter of an effect is fixed after initialization",
                                      0.0);
            if (!(value >= SIZE[k].low && value <= SIZE[k].high)) {
                snprintf(w->message, sizeof w->message, "%s = %g is outside of %g to %g",
                         SIZE[k].name, value, SIZE[k].low, SIZE[k].high);
                return -1;
            }
            *size_of(w, &SIZE[k]) = value;
            return 0;
        }
    *own = 0;
    return 0;
}

int wrapper_get(Wrapper *w, uint32_t reference, double *value, int *own) {
    *own = 1;
    for (int k = 0; k < INPUTS; k++)
        if (INPUT[k].reference == reference) {
            *value = INPUT[k].slope * w->set[k] + INPUT[k].offset;
            return 0;
        }
    for (int k = 0; k < EFFECT_PARAMETER_COUNT; k++)
        if (SIZE[k].reference == reference) {
            *value = *size_of(w, &SIZE[k]);
            return 0;
        }
    for (int k = 0; k < OUTPUTS && w->phase == STEPPING; k++)
        if (OUTPUT[k].reference == reference) {
            *value = OUTPUT[k].slope * w->told[k] + OUTPUT[k].offset;
            return 0;
        }
    *own = 0;
    return 0;
}

/* The signals around the wrapped FMU, SI. */

static int put_inputs(Wrapper *w, const double *values) {
    uint32_t at[INPUTS + 1];
    double there[INPUTS + 1];
    for (int k = 0; k < INPUTS; k++) {
        at[k] = INPUT[k].reference;
        there[k] = INPUT[k].slope * values[k] + INPUT[k].offset;
    }
    return inner_set(w->inner, at, INPUTS, there);
}

static int read_raw(Wrapper *w) {
    uint32_t at[SHOWN + 1];
    const Port *port[SHOWN + 1];
    for (int k = 0; k < SHOWN; k++) {
        port[k] = k < OUTPUTS ? &OUTPUT[k] : &STATE[k - OUTPUTS];
        at[k] = port[k]->reference;
    }
    if (inner_get(w->inner, at, SHOWN, w->raw)) return -1;
    for (int k = 0; k < SHOWN; k++) w->raw[k] = (w->raw[k] - port[k]->offset) / port[k]->slope;
    return 0;
}

static void all_values(const double *inputs, const double *shown, double *values) {
    memcpy(values, inputs, INPUTS * sizeof(double));
    memcpy(values + INPUTS, shown, SHOWN * sizeof(double));
}

int wrapper_drive(Wrapper *w) {
    double values[MOST_VALUES], nothing[SHOWN + 1] = {0.0}, acted[INPUTS + 1];
    w->message[0] = '\0';
    if (acting_begin(&w->inputs, STEP) || acting_begin(&w->rates, STEP) ||
        acting_begin(&w->outputs, STEP))
        return wrapper_failed(w, "a delay is too long", 0.0);
    all_values(w->set, nothing, values);
    acting_at_rest(&w->inputs, values, acted);
    return put_inputs(w, acted);
}

/* Outputs as they are told, those with a delay as they were; told[k] holds what is shown now. */
static int delayed(Wrapper *w) {
    double longest = 0.0;
    for (int k = 0; k < OUTPUTS; k++) longest = fmax(longest, w->late[k]);
    if (longest == 0.0 || w->step == 0.0) return 0;
    if (w->history == NULL) {
        w->kept = (int64_t)(longest / w->step) + 3;
        w->history = calloc(w->kept * (OUTPUTS + 1), sizeof(double));
        if (w->history == NULL) return wrapper_failed(w, "out of memory", 0.0);
    }
    memcpy(w->history + (w->row % w->kept) * OUTPUTS, w->told, OUTPUTS * sizeof(double));
    for (int k = 0; k < OUTPUTS; k++) {
        double place = fmax((double)w->row - w->late[k] / w->step, 0.0);
        int64_t whole = (int64_t)place, after = whole < w->row ? whole + 1 : whole;
        double older = w->history[(whole % w->kept) * OUTPUTS + k];
        double newer = w->history[(after % w->kept) * OUTPUTS + k];
        w->told[k] = older + (place - (double)whole) * (newer - older);
    }
    return 0;
}

/* The states of a wrapped FMU for model exchange. */

/* Whether an indicator has another sign than after the last event. */
static int crossed(Wrapper *w, int *found) {
    double now[MOST_INDICATORS];
    *found = 0;
    if (w->indicators == 0) return 0;
    if (inner_get_indicators(w->inner, now, w->indicators)) return -1;
    for (size_t k = 0; k < w->indicators; k++)
        if ((now[k] > 0.0) != (w->z[k] > 0.0)) *found = 1;
    return 0;
}

static int handle_event(Wrapper *w) {
    int again = 1, timed = 0;
    double when = INFINITY;
    for (int k = 0; again; k++) {
        if (k == MOST_ITERATIONS)
            return wrapper_failed(w, "the discrete states do not settle in %.0f iterations", k);
        if (inner_discrete(w->inner, &again, &timed, &when)) return -1;
    }
    w->next_event = timed ? when : INFINITY;
    if (inner_end_event(w->inner)) return -1;
    return w->indicators ? inner_get_indicators(w->inner, w->z, w->indicators) : 0;
}

static int begin_states(Wrapper *w) {
    w->states = inner_states(w->inner);
    w->indicators = inner_indicators(w->inner);
    if (w->indicators > MOST_INDICATORS)
        return wrapper_failed(w, "there are more than %.0f event indicators", MOST_INDICATORS);
    w->x = calloc(w->states + 1, sizeof(double));
    w->z = calloc(w->indicators + 1, sizeof(double));
    w->work = calloc(6 * w->states + 1, sizeof(double));
    if (!w->x || !w->z || !w->work) return wrapper_failed(w, "out of memory", 0.0);
    return handle_event(w);
}

/* Rates of the states that the file names, with what acts on them. */
static void add_effects(Wrapper *w, Moment m, const double *x, const double *inputs,
                        const double *own, double *dx, double *own_rates) {
    double states[NAMED_STATES + 1], rates[NAMED_STATES + 1];
    for (int k = 0; k < NAMED_STATES; k++) {
        states[k] = (x[STATE_INDEX[k]] - STATE[k].offset) / STATE[k].slope;
        rates[k] = dx[STATE_INDEX[k]] / STATE[k].slope;
    }
    acting_rates(&w->rates, m, inputs, INPUTS, states, own, rates, own_rates);
    for (int k = 0; k < NAMED_STATES; k++) dx[STATE_INDEX[k]] = rates[k] * STATE[k].slope;
}

static int put_states(Wrapper *w, double time, const double *x) {
    return inner_set_time(w->inner, time) || inner_set_states(w->inner, x, w->states) ? -1 : 0;
}

/* The Runge-Kutta rule from a share of a step to its end. The whole step moves the states of effects; a
   part that is repeated after an event does not. begins: whether a row begins. The states at the end,
   and the derivatives at the begin, are in `work`. */
static int runge_kutta(Wrapper *w, double time, double step, double share, const double *inputs,
                       int begins) {
    int own_count = OWN_STATES * RATE_EFFECTS, whole = share == 0.0;
    double own[MOST_VALUES + 1], last[MOST_VALUES + 1] = {0.0}, total[MOST_VALUES + 1] = {0.0};
    double *there = w->work, *dx = there + w->states, *sum = dx + w->states;
    double *end = sum + w->states, *first = end + w->states, length = (1.0 - share) * step;
    memset(dx, 0, 2 * w->states * sizeof(double));
    for (int stage = 0; stage < 4; stage++) {
        double at = share + SHARE[stage] * (1.0 - share);
        Moment m = {w->rates.count, at, at * step, step, WITHIN};
        if (whole && stage == 0) {
            m.when = !begins ? STEP_BEGINS : w->rates.count ? ROW : FIRST;
            m.elapsed = begins ? 0.0 : step;
        }
        for (size_t k = 0; k < w->states; k++) there[k] = w->x[k] + SHARE[stage] * length * dx[k];
        if (put_states(w, time + at * step, there) || inner_rates(w->inner, dx, w->states))
            return -1;
        if (RATE_EFFECTS) {
            for (int k = 0; k < own_count; k++)
                own[k] = w->rates.x[k] + (whole ? SHARE[stage] * step * last[k] : 0.0);
            add_effects(w, m, there, inputs, own, dx, last);
        }
        if (stage == 0) memcpy(first, dx, w->states * sizeof(double));
        for (size_t k = 0; k < w->states; k++) sum[k] += WEIGHT[stage] * dx[k];
        for (int k = 0; k < own_count; k++) total[k] += WEIGHT[stage] * last[k];
    }
    for (int k = 0; k < own_count && whole; k++) w->rates.x[k] += step / 6.0 * total[k];
    for (size_t k = 0; k < w->states; k++) end[k] = w->x[k] + length / 6.0 * sum[k];
    return put_states(w, time + step, end);
}

/* Go to a share of a step, on the cubic through the states and derivatives of both ends of its part
   from `begin`. when: the time. */
static int go_to(Wrapper *w, double begin, double step, double share, double when) {
    double *there = w->work, *end = there + 3 * w->states;
    double *first = end + w->states, *last = first + w->states;
    double s = (share - begin) / (1.0 - begin), scale = (1.0 - begin) * step;
    for (size_t k = 0; k < w->states; k++) {
        double told = (1.0 - s) * w->x[k] + s * end[k];
        double bent = (1.0 - 2.0 * s) * (end[k] - w->x[k]);
        bent += scale * ((s - 1.0) * first[k] + s * last[k]);
        there[k] = told + s * (s - 1.0) * bent;
    }
    return put_states(w, when, there);
}

/* Go to the first event after the share `begin` of a step, which becomes its share. */
static int locate(Wrapper *w, double time, double step, const double *inputs, double *begin) {
    double due = (w->next_event - time) / step, low = *begin, unused[MOST_VALUES + 1];
    double high = fmin(fmax(due, low), 1.0), *end = w->work + 3 * w->states;
    double *last = end + 2 * w->states;
    Moment m = {w->rates.count, 1.0, step, step, WITHIN};
    int sign;
    if (inner_rates(w->inner, last, w->states)) return -1;
    if (RATE_EFFECTS) add_effects(w, m, end, inputs, w->rates.x, last, unused);
    if (go_to(w, *begin, step, high, due < 1.0 + TOLERANCE ? w->next_event : time + high * step) ||
        crossed(w, &sign))
        return -1;
    if (sign) {
        while (high - low > TOLERANCE) {
            double middle = 0.5 * (low + high);
            if (go_to(w, *begin, step, middle, time + middle * step) || crossed(w, &sign))
                return -1;
            if (sign) high = middle;
            else low = middle;
        }
        if (go_to(w, *begin, step, high, time + high * step)) return -1;
    }
    *begin = high;
    return 0;
}

static int complete(Wrapper *w, int event) {
    int needed;
    if (inner_completed(w->inner, &needed)) return -1;
    if (!needed && !event) return 0;
    return inner_begin_event(w->inner) || handle_event(w) ? -1 : 0;
}

/* One step, cut where events lie in it, as explain does. begins: whether a row begins. */
static int integrate(Wrapper *w, double time, double step, const double *inputs, int begins) {
    double begin = 0.0;
    for (int count = 0; begin < 1.0 - TOLERANCE; count++) {
        int event;
        if (inner_get_states(w->inner, w->x, w->states) ||
            runge_kutta(w, time, step, begin, inputs, begins) || crossed(w, &event))
            return -1;
        event = event || (w->next_event - time) / step < 1.0 + TOLERANCE;
        if (!event || count == MOST_EVENTS) {
            if (complete(w, event)) return -1;
            break;
        }
        if (locate(w, time, step, inputs, &begin) || complete(w, 1)) return -1;
    }
    w->rates.count++;
    return 0;
}

/* Effects with a memory are brought up to date before a held input jumps. */
static int end_row(Wrapper *w, double step, const double *inputs) {
    double unused[MOST_VALUES + 1], *dx = w->work;
    Moment m = {w->rates.count - 1, 1.0, step, step, END};
    if (RATE_EFFECTS == 0) return 0;
    if (inner_get_states(w->inner, w->x, w->states) || inner_rates(w->inner, dx, w->states))
        return -1;
    add_effects(w, m, w->x, inputs, w->rates.x, dx, unused);
    return 0;
}

/* Steps. */

int wrapper_initialize(Wrapper *w) {
    double values[MOST_VALUES];
    w->message[0] = '\0';
    if (MODEL_EXCHANGE && begin_states(w)) return -1;
    if (read_raw(w)) return -1;
    memcpy(w->before, w->raw, sizeof w->raw);
    all_values(w->set, w->raw, values);
    acting_at_rest(&w->outputs, values, w->told);
    w->phase = STEPPING;
    return 0;
}

static int begin_rows(Wrapper *w, double time, double step) {
    double inner = step / ceil(step / INNER_STEP - 1e-9);
    w->begin = time;
    w->step = step;
    if (acting_begin(&w->inputs, step / INPUT_PARTS / ceil(step / INPUT_PARTS / STEP - 1e-9)) ||
        acting_begin(&w->rates, inner) || acting_begin(&w->outputs, step / OUTPUT_PARTS))
        return wrapper_failed(w, "a delay is too long for steps of %g s", step);
    return 0;
}

/* Inputs as they act: where one changes within the row, its mean. */
static void act_inputs(Wrapper *w, double step, double *acted) {
    double before[MOST_VALUES], now[MOST_VALUES], ahead[SHOWN + 1], end[INPUTS + 1];
    double from[MOST_VALUES], to[MOST_VALUES], part = step / INPUT_PARTS;
    char held[MOST_VALUES] = {0};
    int substeps = (int)fmax(1.0, ceil(part / STEP - 1e-9));
    memset(held, 1, INPUTS);
    for (int k = 0; k < SHOWN; k++) ahead[k] = 2.0 * w->raw[k] - w->before[k];
    all_values(w->set, w->raw, before);
    all_values(w->set, ahead, now);
    for (int k = 0; k < INPUTS; k++) acted[k] = 0.0;
    for (int p = 0; p < INPUT_PARTS; p++) {
        for (int k = 0; k < INPUTS + SHOWN; k++) {
            from[k] = before[k] + (double)p / INPUT_PARTS * (now[k] - before[k]);
            to[k] = before[k] + (double)(p + 1) / INPUT_PARTS * (now[k] - before[k]);
        }
        acting_row(&w->inputs, from, to, held, substeps, part / substeps, w->row * INPUT_PARTS + p,
                   end);
        for (int k = 0; k < INPUTS; k++) acted[k] += end[k] / INPUT_PARTS;
    }
}

static int advance(Wrapper *w, double time, double step, const double *inputs) {
    int parts = (int)fmax(1.0, ceil(step / INNER_STEP - 1e-9));
    for (int p = 0; p < parts; p++) {
        double at = time + step * p / parts;
        if (MODEL_EXCHANGE ? integrate(w, at, step / parts, inputs, p == 0)
                           : inner_step(w->inner, at, step / parts))
            return -1;
    }
    return MODEL_EXCHANGE ? end_row(w, step / parts, inputs) : 0;
}

int wrapper_step(Wrapper *w, double time, double step) {
    double acted[INPUTS + 1], before[MOST_VALUES], now[MOST_VALUES];
    char held[MOST_VALUES] = {0};
    w->message[0] = '\0';
    if (step == 0.0) return 0;
    if (!(step > 0.0)) return wrapper_failed(w, "a step of %g s: a time above 0 is expected", step);
    if (w->step == 0.0 && begin_rows(w, time, step)) return -1;
    if (fabs(step - w->step) > 1e-6 * w->step)
        return wrapper_failed(w, "all steps have the length of the first one, %.9g s", w->step);
    act_inputs(w, w->step, acted);
    if (put_inputs(w, acted) || advance(w, time, w->step, acted)) return -1;
    memcpy(w->before, w->raw, sizeof w->raw);
    if (read_raw(w)) return -1;
    for (int k = 0; k < SHOWN; k++)
        if (!isfinite(w->raw[k])) return wrapper_failed(w, "a signal is not finite at %g s", time);
    memset(held, 1, INPUTS);
    all_values(acted, w->row > 0 ? w->before : w->raw, before);
    all_values(acted, w->raw, now);
    acting_row(&w->outputs, before, now, held, OUTPUT_PARTS, w->step / OUTPUT_PARTS, w->row,
               w->told);
    if (delayed(w)) return -1;
    w->row++;
    return 0;
}

/* Where the wrapped FMU lies. */

int wrapper_folder(char *folder, size_t length) {
    Dl_info self;
    static char here; /* an address of this library */
    if (dladdr(&here, &self) == 0 || self.dli_fname == NULL) return -1;
    char *path = realpath(self.dli_fname, NULL);
    if (path == NULL) return -1;
    for (int k = 0; k < 3; k++) { /* the library, the platform, "binaries" */
        char *end = strrchr(path, '/');
        if (end != NULL) *end = '\0';
    }
    int used = snprintf(folder, length, "%s/resources/inner", path);
    free(path);
    return used > 0 && (size_t)used < length ? 0 : -1;
}

void wrapper_uri(const char *path, char *uri, size_t length) {
    size_t used = (size_t)snprintf(uri, length, "file://");
    for (; *path != '\0' && used + 4 < length; path++) {
        const char *plain =
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/-_.~";
        if (strchr(plain, *path) != NULL)
            uri[used++] = *path;
        else
            used += (size_t)snprintf(uri + used, 4, "%%%02X", (unsigned char)*path);
    }
    uri[used] = '\0';
}

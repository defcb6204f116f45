/* An FMU with effects around it: what does not depend on the version of FMI.

   The FMU that it wraps lies, unpacked, in resources/inner. It is driven through the functions below,
   which fmi2.c and fmi3.c give. All of them return 0, or -1 with a message in the wrapper. */
#ifndef WRAPPER_H
#define WRAPPER_H

#include <stddef.h>
#include <stdint.h>

#include "effects.h"

#define LONGEST_PATH 4096
#ifdef RTLD_DEEPBIND /* the wrapped FMU calls its own functions, not those of the wrapper */
#define OWN_SYMBOLS RTLD_DEEPBIND
#else
#define OWN_SYMBOLS 0
#endif

/* A real variable of the wrapped FMU: value there = slope * value in SI + offset. */
typedef struct {
    uint32_t reference;
    double slope, offset;
} Port;

/* A parameter of an effect. group: INPUT_SIDE, RATE_SIDE, OUTPUT_SIDE or LATE_SIDE. */
typedef struct {
    uint32_t reference;
    int group, index;
    double start, low, high;
    const char *name;
} Size;
enum { INPUT_SIDE, RATE_SIDE, OUTPUT_SIDE, LATE_SIDE };
enum Phase { INSTANTIATED, INITIALIZING, STEPPING };

typedef struct Inner Inner;
Inner *inner_load(const char *folder, char *message, size_t length);
void inner_free(Inner *inner);
int inner_set(Inner *inner, const uint32_t *references, size_t count, const double *values);
int inner_get(Inner *inner, const uint32_t *references, size_t count, double *values);
int inner_step(Inner *inner, double time, double step);
size_t inner_states(Inner *inner);
size_t inner_indicators(Inner *inner);
int inner_set_time(Inner *inner, double time);
int inner_set_states(Inner *inner, const double *x, size_t count);
int inner_get_states(Inner *inner, double *x, size_t count);
int inner_rates(Inner *inner, double *dx, size_t count);
int inner_get_indicators(Inner *inner, double *z, size_t count);
int inner_completed(Inner *inner, int *event);
int inner_begin_event(Inner *inner);
int inner_discrete(Inner *inner, int *again, int *timed, double *when);
int inner_end_event(Inner *inner);

typedef struct {
    Inner *inner;
    enum Phase phase;
    Acting inputs, rates, outputs;
    double set[INPUTS + 1], raw[SHOWN + 1], before[SHOWN + 1], told[OUTPUTS + 1];
    double late[OUTPUTS + 1], *history; /* of the outputs at all steps that a delay needs */
    int64_t row, kept;
    double step, begin;
    double *x, *z, *work;
    size_t states, indicators;
    double next_event;
    char message[600];
} Wrapper;

int wrapper_failed(Wrapper *w, const char *what, double value);
void wrapper_reset(Wrapper *w); /* sizes and inputs as at the start; the wrapped FMU is not touched */
void wrapper_free(Wrapper *w);
int wrapper_configure(Wrapper *w);  /* calibrated parameters into the wrapped FMU */
int wrapper_drive(Wrapper *w);      /* inputs into the wrapped FMU, before its first step */
int wrapper_initialize(Wrapper *w); /* once the wrapped FMU has been initialized */
int wrapper_step(Wrapper *w, double time, double step);

/* These tell whether a variable is the wrapper's; otherwise it is one of the wrapped FMU alone. */
int wrapper_set(Wrapper *w, uint32_t reference, double value, int *own);
int wrapper_get(Wrapper *w, uint32_t reference, double *value, int *own);

/* Folder of the wrapped FMU, from where this library lies; 0, or -1. */
int wrapper_folder(char *folder, size_t length);
/* The same as a URI. */
void wrapper_uri(const char *path, char *uri, size_t length);

#endif

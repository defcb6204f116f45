/* The motorcycle without any interface: variables by value reference, steps of the kernel.

   tables.h is generated for each FMU: sizes, start values, bounds and names. */
#ifndef MOTORCYCLE_H
#define MOTORCYCLE_H

#include <stddef.h>
#include <stdint.h>
#include "tables.h"

enum Kind { INPUT, PARAMETER, RATIO, INITIAL, OUTPUT };
enum Phase { INSTANTIATED, INITIALIZING, STEPPING };

typedef struct {
    enum Kind kind;
    int index, whole;
    double start, low, high;
    const char *name;
} Variable;

#ifdef FRAMES
typedef struct {
    uint16_t counters[FRAME_COUNT];
    int notifications;
    int64_t sent_until; /* internal step of the next tick */
    size_t size;
    uint8_t data[BUFFER]; /* operations to be sent */
} Can;
#endif

/* Everything that changes: copied as a whole where a master saves and restores a state. */
typedef struct {
    enum Phase phase;
    double begin; /* time at which the simulation started, s */
    double row[INPUTS], parameters[PARAMETERS], ratios[RATIOS], initial[STATES];
    double delays[2], state[SIZE], out[OUTPUTS];
#ifdef FRAMES
    Can can;
#endif
} Numbers;

typedef struct {
    Numbers numbers;
    char message[400]; /* why the last call failed */
} Motorcycle;

void motorcycle_reset(Motorcycle *m);

/* These return 0, or -1 with a message. */
int motorcycle_set(Motorcycle *m, uint32_t reference, double value);
int motorcycle_get(Motorcycle *m, uint32_t reference, double *value);
int motorcycle_initialize(Motorcycle *m);
int motorcycle_step(Motorcycle *m, double time, double step);

double motorcycle_time(const Motorcycle *m);

#endif

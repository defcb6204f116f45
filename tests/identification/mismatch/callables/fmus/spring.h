/* A mass on a spring: x'' = gain force - frequency^2 (x + cube x^3) - 2 damping frequency x'.
   What it lacks of the truth, or does wrong, is chosen when it is compiled. */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef CUBE
#define CUBE 0.0
#endif
#ifndef DEAD_ZONE
#define DEAD_ZONE 0.0
#endif
#define STEP 1e-3 /* s, longest step of integration */

enum { GAIN, FREQUENCY, DAMPING, START, FORCE, POSITION, VELOCITY, RATE, ACCELERATION, ORDER, COUNT };

typedef struct {
    double value[COUNT];
    double time;
    int ready; /* whether it is initialized */
} Spring;

static void rates(Spring *s, const double x[2], double dx[2])
{
    double u = s->value[FORCE], w = s->value[FREQUENCY];
    u -= fmax(fmin(u, DEAD_ZONE), -DEAD_ZONE);
    dx[0] = x[1];
    dx[1] = s->value[GAIN] * u - w * w * (x[0] + CUBE * x[0] * x[0] * x[0])
        - 2.0 * s->value[DAMPING] * w * x[1];
}

static void refresh(Spring *s)
{
    double dx[2];
    rates(s, &s->value[POSITION], dx);
    s->value[RATE] = dx[0];
    s->value[ACCELERATION] = dx[1];
}

static void classical_step(Spring *s, double h)
{
    double *x = &s->value[POSITION], k[4][2], at[2];
    for (int stage = 0; stage < 4; stage++) {
        double ahead = stage == 0 ? 0.0 : stage == 3 ? h : 0.5 * h;
        for (int i = 0; i < 2; i++)
            at[i] = x[i] + (stage ? ahead * k[stage - 1][i] : 0.0);
        rates(s, at, k[stage]);
    }
    for (int i = 0; i < 2; i++)
        x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
}

#ifdef WALL /* m, where it bounces and loses half its speed; in model exchange alone */
enum { INDICATORS = 1 };
static void indicate(const Spring *s, double *z) { z[0] = s->value[POSITION] - WALL; }
static void bounce(Spring *s)
{
    if (s->value[POSITION] < WALL && s->value[VELOCITY] < 0.0)
        s->value[VELOCITY] *= -0.5;
}
#else
enum { INDICATORS = 0 };
static void indicate(const Spring *s, double *z) {}
static void bounce(Spring *s) {}
#endif

/* 0: done. Faults that are compiled in happen where the gain is above 105. */
static int advance(Spring *s, double h)
{
    int steps = (int)ceil(h / STEP - 1e-9);
#ifdef FAULT
    if (s->value[GAIN] > 105.0) {
        if (FAULT == 1) for (;;) usleep(1000);
        if (FAULT == 2) raise(SIGKILL);
        if (FAULT == 3) return 1;
        if (FAULT == 4) s->value[POSITION] = NAN;
    }
#endif
    for (int i = 0; i < steps; i++)
        classical_step(s, h / steps);
    s->time += h;
    return 0;
}

static Spring *new_spring(const char *token)
{
    Spring *s = calloc(1, sizeof(Spring));
    if (strcmp(token, "{spring}") != 0) {
        free(s);
        return NULL;
    }
    s->value[GAIN] = 100.0;
    s->value[FREQUENCY] = 10.0;
    s->value[DAMPING] = 0.1;
    return s;
}

static void initialize(Spring *s)
{
    s->value[POSITION] = s->value[START];
    s->value[VELOCITY] = 0.0;
    s->ready = 1;
}

static int set(Spring *s, const unsigned *which, size_t n, const double *value)
{
    for (size_t i = 0; i < n; i++) {
        if (which[i] >= COUNT)
            return 1;
        s->value[which[i]] = value[i];
    }
    return 0;
}

static int get(Spring *s, const unsigned *which, size_t n, double *value)
{
    refresh(s);
    for (size_t i = 0; i < n; i++) {
        if (which[i] >= COUNT)
            return 1;
        value[i] = s->value[which[i]];
    }
    return 0;
}

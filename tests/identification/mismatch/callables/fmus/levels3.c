/* Two levels under FMI 3.0 whose variables are arrays and of several types:
       x' = -K x + gear * open * u,   gear and open change at events alone
   At the time `pulse` the first level rises by 1: a time event, which counts. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"

enum { K = 1, U, X, RATE, OPEN, GEAR, EVENTS, SINGLE, PULSE, MODE };
#define STEP 1e-3 /* s, longest step of integration in co-simulation */

typedef struct {
    double k[4], u[2], x[2], time, stop, pulse;
    int gear, open, events, in_event, exchange;
    long long mode;
} Levels;

static void rates(const Levels *s, const double x[2], double dx[2])
{
    for (int i = 0; i < 2; i++)
        dx[i] = -s->k[2 * i] * x[0] - s->k[2 * i + 1] * x[1] + s->gear * s->open * s->u[i];
}
static void pulse(Levels *s)
{
    s->x[0] += 1.0;
    s->events++;
    s->pulse = HUGE_VAL;
}
static void integrate(Levels *s, double h)
{
    double a[2], b[2], there[2];
    rates(s, s->x, a);
    for (int i = 0; i < 2; i++) there[i] = s->x[i] + 0.5 * h * a[i];
    rates(s, there, b);
    for (int i = 0; i < 2; i++) s->x[i] += h * b[i];
    s->time += h;
}
static Levels *made(int exchange)
{
    Levels *s = calloc(1, sizeof(Levels));
    s->k[0] = s->k[3] = 1.0;
    s->u[0] = s->u[1] = 1.0;
    s->gear = s->open = 1;
    s->pulse = HUGE_VAL;
    s->exchange = exchange;
    s->in_event = 1;
    return s;
}

/* The numbers of a variable, and how many they are. */
static double *doubles(Levels *s, unsigned which, size_t *n)
{
    *n = which == K ? 4 : which == PULSE || which == 0 ? 1 : 2;
    switch (which) {
    case 0: return &s->time;
    case K: return s->k;
    case U: return s->u;
    case X: return s->x;
    case PULSE: return &s->pulse;
    }
    return NULL;
}

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean log, fmi3Boolean events, fmi3Boolean early,
    const fmi3ValueReference needed[], size_t count, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback say, fmi3IntermediateUpdateCallback update)
{
    return made(0);
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean log, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback say)
{
    return made(1);
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b,
    fmi3Float64 start, fmi3Boolean d, fmi3Float64 stop)
{
    ((Levels *)c)->stop = stop;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n,
    const fmi3Float64 v[], size_t values)
{
    for (size_t i = 0, size = 0, at = 0; i < n; i++, at += size) {
        double *to = doubles(c, r[i], &size);
        if (to == NULL || at + size > values) return fmi3Error;
        memcpy(to, v + at, size * sizeof(*v));
    }
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
    size_t values)
{
    double dx[2];
    rates(c, ((Levels *)c)->x, dx);
    for (size_t i = 0, size = 0, at = 0; i < n; i++, at += size) {
        double *from = r[i] == RATE ? dx : doubles(c, r[i], &size);
        if (r[i] == RATE) size = 2;
        if (from == NULL || at + size > values) return fmi3Error;
        memcpy(v + at, from, size * sizeof(*v));
    }
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[],
    size_t values)
{
    Levels *s = c;
    if (n != 1 || values != 1 || r[0] != GEAR || (s->exchange && !s->in_event)) return fmi3Error;
    s->gear = v[0];
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n,
    const fmi3Boolean v[], size_t values)
{
    Levels *s = c;
    if (n != 1 || values != 1 || r[0] != OPEN || (s->exchange && !s->in_event)) return fmi3Error;
    s->open = v[0];
    return fmi3OK;
}
fmi3Status fmi3SetInt64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int64 v[],
    size_t values)
{
    if (n != 1 || values != 1 || r[0] != MODE) return fmi3Error;
    ((Levels *)c)->mode = v[0];
    return fmi3OK;
}
fmi3Status fmi3GetInt64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int64 v[],
    size_t values)
{
    if (n != 1 || values != 1 || r[0] != MODE) return fmi3Error;
    v[0] = ((Levels *)c)->mode;
    return fmi3OK;
}
fmi3Status fmi3GetUInt8(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3UInt8 v[],
    size_t values)
{
    if (n != 1 || values != 1 || r[0] != EVENTS) return fmi3Error;
    v[0] = ((Levels *)c)->events;
    return fmi3OK;
}
fmi3Status fmi3GetFloat32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float32 v[],
    size_t values)
{
    if (n != 1 || values != 1 || r[0] != SINGLE) return fmi3Error;
    v[0] = (float)((Levels *)c)->x[0];
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean last,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    Levels *s = c;
    double end = time + step;
    if (end > s->stop) return fmi3Error; /* to the last bit, as FMUs of OpenModelica do */
    while (s->time < end - 1e-12) {
        double h = fmin(STEP, fmin(s->pulse, end) - s->time);
        if (h > 0.0) integrate(s, h);
        if (s->time >= s->pulse - 1e-12) pulse(s);
    }
    *event = *terminate = *early = fmi3False;
    *reached = end;
    return fmi3OK;
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) { ((Levels *)c)->in_event = 1; return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *more, fmi3Boolean *terminate,
    fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *timed, fmi3Float64 *next)
{
    Levels *s = c;
    if (s->time >= s->pulse) pulse(s);
    *more = *terminate = *nominals = *states = fmi3False;
    *timed = s->pulse < HUGE_VAL;
    *next = s->pulse;
    return fmi3OK;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { ((Levels *)c)->in_event = 0; return fmi3OK; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean a, fmi3Boolean *event,
    fmi3Boolean *terminate)
{
    *event = *terminate = fmi3False;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { ((Levels *)c)->time = time; return fmi3OK; }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    memcpy(((Levels *)c)->x, x, n * sizeof(*x));
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    memcpy(x, ((Levels *)c)->x, n * sizeof(*x));
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n)
{
    rates(c, ((Levels *)c)->x, dx);
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { return fmi3OK; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { *n = 0; return fmi3OK; }
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { *n = 2; return fmi3OK; }

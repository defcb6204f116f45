/* The spring under FMI 3.0, for co-simulation and model exchange. */
#include "spring.h"
#include "fmi3Functions.h"

#define STATUS(failed) ((failed) ? fmi3Error : fmi3OK)

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean log, fmi3Boolean events, fmi3Boolean early,
    const fmi3ValueReference needed[], size_t count, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback say, fmi3IntermediateUpdateCallback update)
{
#ifdef NO_LICENCE
    if (log)
        say(environment, fmi3Error, "logStatusError", "no licence on server licences.example");
    return NULL;
#endif
    return new_spring(token);
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean log, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback say)
{
    return new_spring(token);
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b,
    fmi3Float64 start, fmi3Boolean d, fmi3Float64 stop)
{
    ((Spring *)c)->time = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { initialize(c); return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n,
    const fmi3Float64 v[], size_t values)
{
    return STATUS(n != values || set(c, r, n, v));
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
    size_t values)
{
    return STATUS(n != values || get(c, r, n, v));
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean last,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    int failed = advance(c, step);
    *event = *terminate = *early = fmi3False;
    *reached = time + step;
#ifdef STOPS_AT
    *terminate = *reached > STOPS_AT;
#endif
    return STATUS(failed);
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *more, fmi3Boolean *terminate,
    fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *timed, fmi3Float64 *next)
{
    *more = *terminate = *nominals = *states = *timed = fmi3False;
    *next = 0.0;
    bounce(c);
    return fmi3OK;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean a, fmi3Boolean *event,
    fmi3Boolean *terminate)
{
    *event = *terminate = fmi3False;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { ((Spring *)c)->time = time; return fmi3OK; }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    memcpy(&((Spring *)c)->value[POSITION], x, n * sizeof(*x));
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    memcpy(x, &((Spring *)c)->value[POSITION], n * sizeof(*x));
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n)
{
    rates(c, &((Spring *)c)->value[POSITION], dx);
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n)
{
    indicate(c, z);
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { *n = INDICATORS; return fmi3OK; }
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { *n = 2; return fmi3OK; }

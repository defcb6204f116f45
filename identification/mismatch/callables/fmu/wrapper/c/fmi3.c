/* The wrapper behind the interface of FMI 3.0 for co-simulation; the wrapped FMU has either one. */
#define _GNU_SOURCE
#include "fmi3Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "wrapper.h"

#define NUMBERS(X)                                                                            \
    X(Float32) X(Int8) X(UInt8) X(Int16) X(UInt16) X(Int32) X(UInt32) X(Int64) X(UInt64)        \
    X(Boolean) X(String)
#define ACCESSED(X)                                                                           \
    X(GetFloat32) X(SetFloat32) X(GetInt8) X(SetInt8) X(GetUInt8) X(SetUInt8) X(GetInt16)       \
    X(SetInt16) X(GetUInt16) X(SetUInt16) X(GetInt32) X(SetInt32) X(GetUInt32) X(SetUInt32)     \
    X(GetInt64) X(SetInt64) X(GetUInt64) X(SetUInt64) X(GetBoolean) X(SetBoolean) X(GetString)  \
    X(SetString) X(GetBinary) X(SetBinary)
#define CALLED(X)                                                                             \
    X(FreeInstance) X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) X(Reset)  \
    X(GetFloat64) X(SetFloat64)
#define STEPPED(X) X(InstantiateCoSimulation) X(DoStep)
#define INTEGRATED(X)                                                                         \
    X(InstantiateModelExchange) X(EnterEventMode) X(UpdateDiscreteStates)                       \
    X(EnterContinuousTimeMode) X(CompletedIntegratorStep) X(SetTime) X(SetContinuousStates)     \
    X(GetContinuousStates) X(GetContinuousStateDerivatives) X(GetEventIndicators)               \
    X(GetNumberOfContinuousStates) X(GetNumberOfEventIndicators)
#if MODEL_EXCHANGE
#define OF_ITS_KIND INTEGRATED
#else
#define OF_ITS_KIND STEPPED
#endif

struct Inner {
    void *library;
    fmi3Instance instance;
#define DECLARE(name) fmi3##name##TYPE *name;
    CALLED(DECLARE) STEPPED(DECLARE) INTEGRATED(DECLARE) ACCESSED(DECLARE)
};

typedef struct {
    Wrapper wrapper;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Slave;

static fmi3Status status(Slave *s, int result) {
    if (result == 0) return fmi3OK;
    if (s->log != NULL && s->wrapper.message[0] != '\0')
        s->log(s->environment, fmi3Error, "logStatusError", s->wrapper.message);
    return fmi3Error;
}

/* The wrapped FMU. */

Inner *inner_load(const char *folder, char *message, size_t length) {
    char path[LONGEST_PATH];
    Inner *i = calloc(1, sizeof *i);
    if (i == NULL) return NULL;
    snprintf(path, sizeof path, "%s/binaries/" INNER_LIBRARY, folder);
    i->library = dlopen(path, RTLD_NOW | RTLD_LOCAL | OWN_SYMBOLS);
    if (i->library == NULL) snprintf(message, length, "%s", dlerror());
#define TAKE(name) \
    if (i->library != NULL) i->name = dlsym(i->library, "fmi3" #name);
#define NEED(name)                                                                            \
    TAKE(name)                                                                                 \
    if (i->library != NULL && i->name == NULL) {                                                \
        snprintf(message, length, "the wrapped FMU has no function fmi3" #name);                \
        dlclose(i->library);                                                                    \
        i->library = NULL;                                                                      \
    }
    ACCESSED(TAKE) CALLED(NEED) OF_ITS_KIND(NEED)
    if (i->library != NULL) return i;
    free(i);
    return NULL;
}

void inner_free(Inner *i) {
    if (i == NULL) return;
    if (i->instance != NULL) i->FreeInstance(i->instance);
    dlclose(i->library);
    free(i);
}

static int bad(fmi3Status told) { return told == fmi3OK || told == fmi3Warning ? 0 : -1; }

int inner_set(Inner *i, const uint32_t *r, size_t n, const double *v) {
    return n == 0 ? 0 : bad(i->SetFloat64(i->instance, r, n, v, n));
}
int inner_get(Inner *i, const uint32_t *r, size_t n, double *v) {
    return n == 0 ? 0 : bad(i->GetFloat64(i->instance, r, n, v, n));
}
int inner_step(Inner *i, double time, double step) {
    fmi3Boolean event = fmi3False, terminate = fmi3False, early = fmi3False;
    fmi3Float64 reached = time + step;
    int told = bad(i->DoStep(i->instance, time, step, fmi3True, &event, &terminate, &early, &reached));
    return told || terminate || early ? -1 : 0;
}
size_t inner_states(Inner *i) {
    size_t n = 0;
    return i->GetNumberOfContinuousStates(i->instance, &n) == fmi3OK ? n : 0;
}
size_t inner_indicators(Inner *i) {
    size_t n = 0;
    return i->GetNumberOfEventIndicators(i->instance, &n) == fmi3OK ? n : 0;
}
int inner_set_time(Inner *i, double time) { return bad(i->SetTime(i->instance, time)); }
int inner_set_states(Inner *i, const double *x, size_t n) {
    return n == 0 ? 0 : bad(i->SetContinuousStates(i->instance, x, n));
}
int inner_get_states(Inner *i, double *x, size_t n) {
    return n == 0 ? 0 : bad(i->GetContinuousStates(i->instance, x, n));
}
int inner_rates(Inner *i, double *dx, size_t n) {
    return n == 0 ? 0 : bad(i->GetContinuousStateDerivatives(i->instance, dx, n));
}
int inner_get_indicators(Inner *i, double *z, size_t n) {
    return bad(i->GetEventIndicators(i->instance, z, n));
}
int inner_completed(Inner *i, int *event) {
    fmi3Boolean enter = fmi3False, ended = fmi3False;
    int told = bad(i->CompletedIntegratorStep(i->instance, fmi3True, &enter, &ended));
    *event = enter;
    return told || ended ? -1 : 0;
}
int inner_begin_event(Inner *i) { return bad(i->EnterEventMode(i->instance)); }
int inner_discrete(Inner *i, int *again, int *timed, double *when) {
    fmi3Boolean more = fmi3False, ended = fmi3False, nominals, values, known = fmi3False;
    int told = bad(i->UpdateDiscreteStates(i->instance, &more, &ended, &nominals, &values, &known, when));
    *again = more;
    *timed = known;
    return told || ended ? -1 : 0;
}
int inner_end_event(Inner *i) { return bad(i->EnterContinuousTimeMode(i->instance)); }

/* The wrapper. */

const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String of[]) {
    return (void)c, (void)on, (void)n, (void)of, fmi3OK;
}

void fmi3FreeInstance(fmi3Instance c) {
    Slave *s = c;
    if (s == NULL) return;
    inner_free(s->wrapper.inner);
    wrapper_free(&s->wrapper);
    free(s);
}

static fmi3Instance wrapped(Slave *s, const char *name, const char *resources, fmi3Boolean visible,
                            fmi3Boolean logging) {
    Inner *i = s->wrapper.inner;
#if MODEL_EXCHANGE
    return i->InstantiateModelExchange(name, INNER_TOKEN, resources, visible, logging,
                                       s->environment, s->log);
#else
    return i->InstantiateCoSimulation(name, INNER_TOKEN, resources, visible, logging, fmi3False,
                                      fmi3False, NULL, 0, s->environment, s->log, NULL);
#endif
}

static int instantiate(Slave *s, const char *name, const char *token, fmi3Boolean visible,
                       fmi3Boolean logging) {
    char folder[LONGEST_PATH], resources[LONGEST_PATH + 16];
    Wrapper *w = &s->wrapper;
    wrapper_reset(w);
    if (strcmp(token, TOKEN) != 0)
        return wrapper_failed(w, "the instantiation token is not that of this FMU", 0.0);
    if (wrapper_folder(folder, sizeof folder))
        return wrapper_failed(w, "the folder of this FMU is not found", 0.0);
    w->inner = inner_load(folder, w->message, sizeof w->message);
    if (w->inner == NULL) return wrapper_failed(w, "the wrapped FMU cannot be loaded", 0.0);
    snprintf(resources, sizeof resources, "%s/resources/", folder);
    w->inner->instance = wrapped(s, name, resources, visible, logging);
    if (w->inner->instance == NULL)
        return wrapper_failed(w, "the wrapped FMU cannot be instantiated", 0.0);
    return wrapper_configure(w);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference needed[],
    size_t count, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    (void)resources, (void)events, (void)early, (void)needed, (void)count, (void)update;
    Slave *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    s->environment = environment;
    s->log = log;
    if (status(s, instantiate(s, name, token, visible, logging)) == fmi3OK) return s;
    fmi3FreeInstance(s);
    return NULL;
}

#define INNER(c) (((Slave *)(c))->wrapper.inner)
#define OF(c) (INNER(c)->instance)

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stops, fmi3Float64 stop) {
    ((Slave *)c)->wrapper.phase = INITIALIZING;
    return INNER(c)->EnterInitializationMode(OF(c), tolerant, tolerance, start, stops, stop);
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Slave *s = c;
    if (wrapper_drive(&s->wrapper)) return status(s, -1);
    fmi3Status told = INNER(c)->ExitInitializationMode(OF(c));
    if (bad(told)) return told;
    return status(s, wrapper_initialize(&s->wrapper));
}
fmi3Status fmi3Terminate(fmi3Instance c) { return INNER(c)->Terminate(OF(c)); }
fmi3Status fmi3Reset(fmi3Instance c) {
    Slave *s = c;
    fmi3Status told = INNER(c)->Reset(OF(c));
    if (bad(told)) return told;
    wrapper_reset(&s->wrapper);
    return status(s, wrapper_configure(&s->wrapper));
}

/* An array has more values than references: only the wrapped FMU has those. */
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                          const fmi3Float64 v[], size_t values) {
    Slave *s = c;
    if (n != values) return INNER(c)->SetFloat64(OF(c), r, n, v, values);
    for (size_t k = 0; k < n; k++) {
        int own;
        if (wrapper_set(&s->wrapper, r[k], v[k], &own)) return status(s, -1);
        if (own) continue;
        fmi3Status told = INNER(c)->SetFloat64(OF(c), &r[k], 1, &v[k], 1);
        if (bad(told)) return told;
    }
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
                          size_t values) {
    Slave *s = c;
    if (n != values) return INNER(c)->GetFloat64(OF(c), r, n, v, values);
    for (size_t k = 0; k < n; k++) {
        int own;
        if (wrapper_get(&s->wrapper, r[k], &v[k], &own)) return status(s, -1);
        if (own) continue;
        fmi3Status told = INNER(c)->GetFloat64(OF(c), &r[k], 1, &v[k], 1);
        if (bad(told)) return told;
    }
    return fmi3OK;
}

#define PASSED_ON(type)                                                                       \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference r[], size_t n,            \
                             const fmi3##type v[], size_t values) {                             \
        if (INNER(c)->Set##type == NULL) return fmi3Error;                                      \
        return n == 0 ? fmi3OK : INNER(c)->Set##type(OF(c), r, n, v, values);                   \
    }                                                                                           \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference r[], size_t n,            \
                             fmi3##type v[], size_t values) {                                   \
        if (INNER(c)->Get##type == NULL) return fmi3Error;                                      \
        return n == 0 ? fmi3OK : INNER(c)->Get##type(OF(c), r, n, v, values);                   \
    }
NUMBERS(PASSED_ON)

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                         const size_t sizes[], const fmi3Binary v[], size_t values) {
    if (INNER(c)->SetBinary == NULL) return fmi3Error;
    return n == 0 ? fmi3OK : INNER(c)->SetBinary(OF(c), r, n, sizes, v, values);
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[],
                         fmi3Binary v[], size_t values) {
    if (INNER(c)->GetBinary == NULL) return fmi3Error;
    return n == 0 ? fmi3OK : INNER(c)->GetBinary(OF(c), r, n, sizes, v, values);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean never_back,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *reached) {
    (void)never_back;
    Slave *s = c;
    *event = *terminate = *early = fmi3False;
    *reached = time + step;
    if (wrapper_step(&s->wrapper, time, step) == 0) return fmi3OK;
    *reached = time;
    wrapper_failed(&s->wrapper, "the wrapped FMU fails in the step from %g s", time);
    return status(s, -1);
}

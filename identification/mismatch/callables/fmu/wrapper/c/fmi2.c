/* The wrapper behind the interface of FMI 2.0 for co-simulation; the wrapped FMU has either one. */
#define _GNU_SOURCE
#include "fmi2Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "wrapper.h"

#define CALLED(X)                                                                              \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode)                \
    X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(SetReal) X(GetInteger)         \
    X(SetInteger) X(GetBoolean) X(SetBoolean) X(GetString) X(SetString)
#define STEPPED(X) X(DoStep)
#define INTEGRATED(X)                                                                          \
    X(EnterEventMode) X(NewDiscreteStates) X(EnterContinuousTimeMode) X(CompletedIntegratorStep) \
    X(SetTime) X(SetContinuousStates) X(GetContinuousStates) X(GetDerivatives)                  \
    X(GetEventIndicators)
#if MODEL_EXCHANGE
#define OF_ITS_KIND INTEGRATED
#else
#define OF_ITS_KIND STEPPED
#endif

struct Inner {
    void *library;
    fmi2Component component;
#define DECLARE(name) fmi2##name##TYPE *name;
    CALLED(DECLARE) STEPPED(DECLARE) INTEGRATED(DECLARE)
};

typedef struct {
    Wrapper wrapper;
    fmi2CallbackFunctions callbacks;
    char *name;
} Slave;

static fmi2Status status(Slave *s, int result) {
    if (result == 0) return fmi2OK;
    if (s->callbacks.logger != NULL && s->wrapper.message[0] != '\0')
        s->callbacks.logger(s->callbacks.componentEnvironment, s->name, fmi2Error,
                            "logStatusError", "%s", s->wrapper.message);
    return fmi2Error;
}

/* The wrapped FMU. */

Inner *inner_load(const char *folder, char *message, size_t length) {
    char path[LONGEST_PATH];
    Inner *i = calloc(1, sizeof *i);
    if (i == NULL) return NULL;
    snprintf(path, sizeof path, "%s/binaries/" INNER_LIBRARY, folder);
    i->library = dlopen(path, RTLD_NOW | RTLD_LOCAL | OWN_SYMBOLS);
    if (i->library == NULL) snprintf(message, length, "%s", dlerror());
#define FIND(name)                                                                            \
    if (i->library != NULL && (i->name = dlsym(i->library, "fmi2" #name)) == NULL) {            \
        snprintf(message, length, "the wrapped FMU has no function fmi2" #name);                \
        dlclose(i->library);                                                                    \
        i->library = NULL;                                                                      \
    }
    CALLED(FIND) OF_ITS_KIND(FIND)
    if (i->library != NULL) return i;
    free(i);
    return NULL;
}

void inner_free(Inner *i) {
    if (i == NULL) return;
    if (i->component != NULL) i->FreeInstance(i->component);
    dlclose(i->library);
    free(i);
}

static int bad(fmi2Status told) { return told == fmi2OK || told == fmi2Warning ? 0 : -1; }

int inner_set(Inner *i, const uint32_t *r, size_t n, const double *v) {
    return n == 0 ? 0 : bad(i->SetReal(i->component, r, n, v));
}
int inner_get(Inner *i, const uint32_t *r, size_t n, double *v) {
    return n == 0 ? 0 : bad(i->GetReal(i->component, r, n, v));
}
int inner_step(Inner *i, double time, double step) {
    return bad(i->DoStep(i->component, time, step, fmi2True));
}
size_t inner_states(Inner *i) { return (void)i, STATE_COUNT; }
size_t inner_indicators(Inner *i) { return (void)i, INDICATOR_COUNT; }
int inner_set_time(Inner *i, double time) { return bad(i->SetTime(i->component, time)); }
int inner_set_states(Inner *i, const double *x, size_t n) {
    return n == 0 ? 0 : bad(i->SetContinuousStates(i->component, x, n));
}
int inner_get_states(Inner *i, double *x, size_t n) {
    return n == 0 ? 0 : bad(i->GetContinuousStates(i->component, x, n));
}
int inner_rates(Inner *i, double *dx, size_t n) {
    return n == 0 ? 0 : bad(i->GetDerivatives(i->component, dx, n));
}
int inner_get_indicators(Inner *i, double *z, size_t n) {
    return bad(i->GetEventIndicators(i->component, z, n));
}
int inner_completed(Inner *i, int *event) {
    fmi2Boolean enter = fmi2False, ended = fmi2False;
    int told = bad(i->CompletedIntegratorStep(i->component, fmi2True, &enter, &ended));
    *event = enter;
    return told || ended ? -1 : 0;
}
int inner_begin_event(Inner *i) { return bad(i->EnterEventMode(i->component)); }
int inner_discrete(Inner *i, int *again, int *timed, double *when) {
    fmi2EventInfo info = {0};
    int told = bad(i->NewDiscreteStates(i->component, &info));
    *again = info.newDiscreteStatesNeeded;
    *timed = info.nextEventTimeDefined;
    *when = info.nextEventTime;
    return told || info.terminateSimulation ? -1 : 0;
}
int inner_end_event(Inner *i) { return bad(i->EnterContinuousTimeMode(i->component)); }

/* The wrapper. */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String of[]) {
    return (void)c, (void)on, (void)n, (void)of, fmi2OK;
}

void fmi2FreeInstance(fmi2Component c) {
    Slave *s = c;
    if (s == NULL) return;
    inner_free(s->wrapper.inner);
    wrapper_free(&s->wrapper);
    free(s->name);
    free(s);
}

static int instantiate(Slave *s, const char *token, fmi2Boolean visible, fmi2Boolean logging) {
    char folder[LONGEST_PATH], resources[LONGEST_PATH + 16], uri[3 * LONGEST_PATH];
    Wrapper *w = &s->wrapper;
    wrapper_reset(w);
    if (strcmp(token, TOKEN) != 0) return wrapper_failed(w, "the GUID is not that of this FMU", 0.0);
    if (wrapper_folder(folder, sizeof folder))
        return wrapper_failed(w, "the folder of this FMU is not found", 0.0);
    w->inner = inner_load(folder, w->message, sizeof w->message);
    if (w->inner == NULL) return wrapper_failed(w, "the wrapped FMU cannot be loaded", 0.0);
    snprintf(resources, sizeof resources, "%s/resources", folder);
    wrapper_uri(resources, uri, sizeof uri);
    w->inner->component =
        w->inner->Instantiate(s->name, MODEL_EXCHANGE ? fmi2ModelExchange : fmi2CoSimulation,
                              INNER_TOKEN, uri, &s->callbacks, visible, logging);
    if (w->inner->component == NULL)
        return wrapper_failed(w, "the wrapped FMU cannot be instantiated", 0.0);
    return wrapper_configure(w);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)resources;
    Slave *s = type == fmi2CoSimulation ? calloc(1, sizeof *s) : NULL;
    if (s == NULL) return NULL;
    if (callbacks != NULL) s->callbacks = *callbacks;
    s->name = strdup(name);
    if (status(s, instantiate(s, token, visible, logging)) == fmi2OK) return s;
    fmi2FreeInstance(s);
    return NULL;
}

#define INNER(c) (((Slave *)(c))->wrapper.inner)
#define OF(c) (INNER(c)->component)

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    return INNER(c)->SetupExperiment(OF(c), tolerant, tolerance, start, stops, stop);
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ((Slave *)c)->wrapper.phase = INITIALIZING;
    return INNER(c)->EnterInitializationMode(OF(c));
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Slave *s = c;
    if (wrapper_drive(&s->wrapper)) return status(s, -1);
    fmi2Status told = INNER(c)->ExitInitializationMode(OF(c));
    if (bad(told)) return told;
    return status(s, wrapper_initialize(&s->wrapper));
}
fmi2Status fmi2Terminate(fmi2Component c) { return INNER(c)->Terminate(OF(c)); }
fmi2Status fmi2Reset(fmi2Component c) {
    Slave *s = c;
    fmi2Status told = INNER(c)->Reset(OF(c));
    if (bad(told)) return told;
    wrapper_reset(&s->wrapper);
    return status(s, wrapper_configure(&s->wrapper));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        int own;
        if (wrapper_set(&s->wrapper, r[k], v[k], &own)) return status(s, -1);
        if (own) continue;
        fmi2Status told = INNER(c)->SetReal(OF(c), &r[k], 1, &v[k]);
        if (bad(told)) return told;
    }
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        int own;
        if (wrapper_get(&s->wrapper, r[k], &v[k], &own)) return status(s, -1);
        if (own) continue;
        fmi2Status told = INNER(c)->GetReal(OF(c), &r[k], 1, &v[k]);
        if (bad(told)) return told;
    }
    return fmi2OK;
}

#define PASSED_ON(type)                                                                       \
    fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference r[], size_t n,           \
                             const fmi2##type v[]) {                                            \
        return n == 0 ? fmi2OK : INNER(c)->Set##type(OF(c), r, n, v);                           \
    }                                                                                           \
    fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference r[], size_t n,           \
                             fmi2##type v[]) {                                                  \
        return n == 0 ? fmi2OK : INNER(c)->Get##type(OF(c), r, n, v);                           \
    }
PASSED_ON(Integer)
PASSED_ON(Boolean)
PASSED_ON(String)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean never_back) {
    (void)never_back;
    Slave *s = c;
    if (wrapper_step(&s->wrapper, time, step) == 0) return fmi2OK;
    wrapper_failed(&s->wrapper, "the wrapped FMU fails in the step from %g s", time);
    return status(s, -1);
}

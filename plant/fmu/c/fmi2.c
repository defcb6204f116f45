/* The motorcycle behind the interface of FMI 2.0 for co-simulation. */
#include "fmi2Functions.h"

#include <stdlib.h>
#include <string.h>
#include "motorcycle.h"

typedef struct {
    Motorcycle motorcycle;
    fmi2CallbackFunctions callbacks;
    char *name;
} Slave;

static fmi2Status status(Slave *s, int result) {
    if (result == 0) return fmi2OK;
    if (s->callbacks.logger != NULL)
        s->callbacks.logger(s->callbacks.componentEnvironment, s->name, fmi2Error,
                            "logStatusError", "%s", s->motorcycle.message);
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String of[]) {
    (void)c, (void)on, (void)n, (void)of;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    Slave *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    if (callbacks != NULL) s->callbacks = *callbacks;
    s->name = malloc(strlen(name) + 1);
    if (s->name != NULL) strcpy(s->name, name);
    motorcycle_reset(&s->motorcycle);
    const char *why = type != fmi2CoSimulation ? "this FMU is for co-simulation"
                      : strcmp(guid, TOKEN) != 0 ? "the GUID is not that of this FMU"
                      : s->name == NULL ? "no memory" : NULL;
    if (why == NULL) return s;
    strcpy(s->motorcycle.message, why);
    status(s, -1);
    fmi2FreeInstance(s);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c == NULL) return;
    free(((Slave *)c)->name);
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    ((Slave *)c)->motorcycle.numbers.begin = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ((Slave *)c)->motorcycle.numbers.phase = INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return status(c, motorcycle_initialize(&((Slave *)c)->motorcycle));
}

fmi2Status fmi2Terminate(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return motorcycle_reset(&((Slave *)c)->motorcycle), fmi2OK; }

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    int result = 0;
    for (size_t k = 0; k < n && result == 0; k++)
        result = motorcycle_set(&((Slave *)c)->motorcycle, r[k], v[k]);
    return status(c, result);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    int result = 0;
    for (size_t k = 0; k < n && result == 0; k++)
        result = motorcycle_get(&((Slave *)c)->motorcycle, r[k], &v[k]);
    return status(c, result);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean never_back) {
    (void)never_back;
    return status(c, motorcycle_step(&((Slave *)c)->motorcycle, time, step));
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    if (*kept == NULL) *kept = malloc(sizeof(Numbers));
    if (*kept == NULL) return fmi2Error;
    memcpy(*kept, &((Slave *)c)->motorcycle.numbers, sizeof(Numbers));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate kept) {
    memcpy(&((Slave *)c)->motorcycle.numbers, kept, sizeof(Numbers));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    (void)c;
    free(*kept);
    *kept = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate kept, size_t *size) {
    (void)c, (void)kept;
    *size = sizeof(Numbers);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate kept, fmi2Byte to[], size_t size) {
    (void)c;
    if (size != sizeof(Numbers)) return fmi2Error;
    memcpy(to, kept, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte from[], size_t size,
                                   fmi2FMUstate *kept) {
    (void)c;
    if (size != sizeof(Numbers)) return fmi2Error;
    if (*kept == NULL) *kept = malloc(size);
    if (*kept == NULL) return fmi2Error;
    memcpy(*kept, from, size);
    return fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    return (void)c, (void)s, (void)value, fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    if (s != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = motorcycle_time(&((Slave *)c)->motorcycle);
    return fmi2OK;
}

/* The motorcycle behind the interface of FMI 3.0 for co-simulation. */
#include "slave3.h"

#include <stdlib.h>
#include <string.h>

/* 0: well; below 0: an error; above 0: a warning. The last two are logged with the message. */
fmi3Status slave_status(Slave *s, int result) {
    if (result == 0) return fmi3OK;
    fmi3Status found = result < 0 ? fmi3Error : fmi3Warning;
    const char *category = result < 0 ? "logStatusError" : "logStatusWarning";
    if (s->log != NULL) s->log(s->environment, found, category, s->motorcycle.message);
    return found;
}

const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String of[]) {
    (void)c, (void)on, (void)n, (void)of;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference needed[],
    size_t count, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early;
    (void)needed, (void)count, (void)update;
    Slave *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    s->environment = environment;
    s->log = log;
    motorcycle_reset(&s->motorcycle);
    if (strcmp(token, TOKEN) == 0) return s;
    strcpy(s->motorcycle.message, "the instantiation token is not that of this FMU");
    slave_status(s, -1);
    free(s);
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    ((Slave *)c)->motorcycle.numbers.phase = INITIALIZING;
    ((Slave *)c)->motorcycle.numbers.begin = start;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    return slave_status(c, motorcycle_initialize(&((Slave *)c)->motorcycle));
}

fmi3Status fmi3Terminate(fmi3Instance c) { return (void)c, fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) {
    ((Slave *)c)->receiving = ((Slave *)c)->sending = 0;
    motorcycle_reset(&((Slave *)c)->motorcycle);
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                          const fmi3Float64 v[], size_t values) {
    int result = 0;
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n && result == 0; k++)
        result = motorcycle_set(&((Slave *)c)->motorcycle, r[k], v[k]);
    return slave_status(c, result);
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
                          size_t values) {
    int result = 0;
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n && result == 0; k++) {
        if (r[k] == 0)
            v[k] = motorcycle_time(&((Slave *)c)->motorcycle);
        else
            result = motorcycle_get(&((Slave *)c)->motorcycle, r[k], &v[k]);
    }
    return slave_status(c, result);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean never_back,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *reached) {
    (void)never_back;
    int result = motorcycle_step(&((Slave *)c)->motorcycle, time, step);
    *event = *terminate = *early = fmi3False;
    *reached = motorcycle_time(&((Slave *)c)->motorcycle);
    return slave_status(c, result);
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *kept) {
    if (*kept == NULL) *kept = malloc(sizeof(Numbers));
    if (*kept == NULL) return fmi3Error;
    memcpy(*kept, &((Slave *)c)->motorcycle.numbers, sizeof(Numbers));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState kept) {
    memcpy(&((Slave *)c)->motorcycle.numbers, kept, sizeof(Numbers));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *kept) {
    (void)c;
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState kept, size_t *size) {
    (void)c, (void)kept;
    *size = sizeof(Numbers);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState kept, fmi3Byte to[], size_t size) {
    (void)c;
    if (size != sizeof(Numbers)) return fmi3Error;
    memcpy(to, kept, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte from[], size_t size,
                                   fmi3FMUState *kept) {
    (void)c;
    if (size != sizeof(Numbers)) return fmi3Error;
    if (*kept == NULL) *kept = malloc(size);
    if (*kept == NULL) return fmi3Error;
    memcpy(*kept, from, size);
    return fmi3OK;
}

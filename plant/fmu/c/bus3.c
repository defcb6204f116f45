/* Clocks and binary variables of FMI 3.0: the terminal of FMI-LS-BUS. */
#include "can.h"
#include "slave3.h"

#include <stdio.h>

enum { RX_DATA = CAN_REFERENCE, TX_DATA, RX_CLOCK, TX_CLOCK, NOTIFICATIONS };

static fmi3Status refused(Slave *s, const char *what) {
    snprintf(s->motorcycle.message, sizeof s->motorcycle.message, "%s", what);
    return slave_status(s, -1);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) { return (void)c, fmi3OK; }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return (void)c, fmi3OK; }

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                        const fmi3Clock v[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] == RX_CLOCK) {
            s->receiving = v[k];
        } else if (r[k] == TX_CLOCK) {
            int result = v[k] && !s->sending ? can_send(&s->motorcycle) : 0;
            s->sending = v[k];
            if (result != 0) return slave_status(s, result);
        } else {
            return refused(s, "no clock has this value reference");
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Clock v[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] != RX_CLOCK && r[k] != TX_CLOCK)
            return refused(s, "no clock has this value reference");
        v[k] = r[k] == RX_CLOCK ? s->receiving : s->sending;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                         const size_t sizes[], const fmi3Binary v[], size_t values) {
    Slave *s = c;
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (r[k] != RX_DATA) return refused(s, "no binary input has this value reference");
        if (sizes[k] == 0) continue;
        if (!s->receiving) return refused(s, "Rx_Data is set while Rx_Clock is not active");
        int result = can_receive(&s->motorcycle, v[k], sizes[k]);
        if (result != 0) return slave_status(s, result);
    }
    return fmi3OK;
}

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[],
                         fmi3Binary v[], size_t values) {
    Slave *s = c;
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (r[k] != TX_DATA) return refused(s, "no binary output has this value reference");
        v[k] = s->motorcycle.numbers.can.data;
        sizes[k] = s->sending ? s->motorcycle.numbers.can.size : 0;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                          const fmi3Boolean v[], size_t values) {
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (r[k] != NOTIFICATIONS) return refused(c, "no truth value has this value reference");
        ((Slave *)c)->motorcycle.numbers.can.notifications = v[k];
    }
    return fmi3OK;
}

fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Boolean v[],
                          size_t values) {
    if (n != values) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (r[k] != NOTIFICATIONS) return refused(c, "no truth value has this value reference");
        v[k] = ((Slave *)c)->motorcycle.numbers.can.notifications;
    }
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values,
                                    fmi3Boolean *defined, fmi3Float64 *next) {
    Slave *s = c;
    if (s->sending) s->motorcycle.numbers.can.size = 0; /* the master has read it */
    s->sending = s->receiving = 0;
    *again = *terminate = *nominals = *values = *defined = fmi3False;
    *next = 0.0;
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                                  fmi3Float64 v[], fmi3IntervalQualifier qualifiers[]) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] != TX_CLOCK) return refused(c, "no clock of a time has this value reference");
        v[k] = TICK_STEPS * STEP;
        qualifiers[k] = fmi3IntervalUnchanged;
    }
    return fmi3OK;
}

/* An instance behind the interface of FMI 3.0. */
#ifndef SLAVE3_H
#define SLAVE3_H

#include "fmi3Functions.h"
#include "motorcycle.h"

typedef struct {
    Motorcycle motorcycle;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int receiving, sending; /* clocks that are active in this event */
} Slave;

fmi3Status slave_status(Slave *s, int result);

#endif

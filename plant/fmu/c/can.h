/* CAN frames of the motorcycle as operations of FMI-LS-BUS 1.0 (network abstraction). */
#ifndef CAN_H
#define CAN_H

#include "motorcycle.h"

/* These return 0; 1: something is lost; or -1: it cannot be done. The last two with a message. */

/* Fill the buffer with the frames that are due now. */
int can_send(Motorcycle *m);
/* Take over what a buffer of operations contains. */
int can_receive(Motorcycle *m, const uint8_t *data, size_t size);

#endif

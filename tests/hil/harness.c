/* The throttle body for ctypes: its core, without SocketCAN and without a clock. */
#include <stdlib.h>

#include "throttle_body.h"

struct throttle_body *device_new(void)
{
        struct throttle_body *body = malloc(sizeof *body);

        if (body)
                throttle_body_start(body);
        return body;
}

void device_jam(struct throttle_body *body)
{
        body->plate.jammed = true;
}

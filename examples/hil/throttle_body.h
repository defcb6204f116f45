/* Throttle body with a position controller: a device under test for slipbench.
 *
 * It follows the bench (ActuatorCommand) while that holds authority over the throttle, else the rider's
 * grip (RiderControls), and reports ThrottleStatus every millisecond. No system calls: `main.c` connects
 * it to SocketCAN and a clock, tests/hil to a simulated bus and clock.
 */
#ifndef THROTTLE_BODY_H
#define THROTTLE_BODY_H

#include <stdbool.h>
#include <stdint.h>

#include "e2e.h"
#include "plate.h"

#define COMMAND_ID 0x10u
#define STATUS_ID 0x30u
#define RIDER_ID 0x70u
#define STATUS_LENGTH 8

#define CYCLE_US 1000u
#define WATCHDOG_US 20000u      /* without a valid command: authority returns to the rider */
#define RIDER_TIMEOUT_US 50000u /* without valid controls: authority ends, the throttle closes */
#define SETPOINT_RATE 8.0       /* 1/s, limit */
#define MOST_CURRENT 8.0        /* A, limit */
#define FOLLOWING_ERROR 0.05    /* of the opening; for longer than FOLLOWING_US the plate does not follow */
#define FOLLOWING_US 150000u

enum authority { AUTHORITY_NONE = 0, AUTHORITY_THROTTLE = 1 };

struct throttle_body {
        struct e2e_receiver command_receiver, rider_receiver;
        uint8_t authority;        /* of the last valid command */
        double commanded, grip;   /* openings, 0 to 1 */
        uint64_t command_us, rider_us, step_us; /* times of the last command, controls and step */
        bool rider_known, started;
        bool latched;             /* authority ended without a release; a release must come first */
        double setpoint, last_position, integral, current; /* A */
        uint64_t following_us;    /* since when the plate has not followed; 0: it follows */
        bool faulty;
        uint8_t counter;
        struct plate plate;
};

/* Start with the plate at its rest position, without authority. Times in us of any monotonic clock. */
void throttle_body_start(struct throttle_body *body);

/* Take a data frame with a standard identifier that arrived at now_us. */
void throttle_body_receive(struct throttle_body *body, uint32_t identifier, const uint8_t *data,
                           uint8_t length, uint64_t now_us);

/* Run one cycle at now_us; writes the payload of ThrottleStatus. Returns whether it is to be sent. */
bool throttle_body_step(struct throttle_body *body, uint64_t now_us, uint8_t status[STATUS_LENGTH]);

#endif

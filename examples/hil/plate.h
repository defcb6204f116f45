/* The simulated hardware: motor, return spring and plate. x'' = a i - spring(x) - d x' - friction.
 *
 * x: opening, 0 to 1; i: motor current, A. The springs of both directions hold the plate at the
 * limp-home opening when the motor has no current. A jammed plate stands still.
 */
#ifndef PLATE_H
#define PLATE_H

#include <stdbool.h>

#define LIMP_HOME 0.07

struct plate {
        double position, velocity; /* 1, 1/s */
        bool jammed;
};

/* Move for a millisecond under a constant motor current, A. */
void plate_move(struct plate *plate, double current);

#endif

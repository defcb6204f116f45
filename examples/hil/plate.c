#include "plate.h"

#define STEPS 20
#define STEP (1e-3 / STEPS)  /* s */
#define PER_AMPERE 400.0     /* 1/s^2 for each A */
#define PRELOAD 240.0        /* 1/s^2, of the springs at the limp-home opening */
#define STIFFNESS 300.0      /* 1/s^2 */
#define DAMPING 25.0         /* 1/s */
#define FRICTION 40.0        /* 1/s^2, Coulomb */
#define SLOW 0.02            /* 1/s; below it friction is proportional to the velocity */

/* Value between -1 and 1, proportional within +-width. */
static double smooth_sign(double value, double width)
{
        return value > width ? 1.0 : value < -width ? -1.0 : value / width;
}

static double acceleration(const struct plate *plate, double current)
{
        double deflection = plate->position - LIMP_HOME;

        return PER_AMPERE * current - PRELOAD * smooth_sign(deflection, 0.005) -
               STIFFNESS * deflection - DAMPING * plate->velocity -
               FRICTION * smooth_sign(plate->velocity, SLOW);
}

void plate_move(struct plate *plate, double current)
{
        for (int n = 0; n < STEPS; n++) {
                plate->velocity += STEP * acceleration(plate, current);
                if (plate->jammed)
                        plate->velocity = 0.0;
                plate->position += STEP * plate->velocity;
                if (plate->position < 0.0 || plate->position > 1.0) {
                        plate->position = plate->position < 0.0 ? 0.0 : 1.0;
                        plate->velocity = 0.0;
                }
        }
}

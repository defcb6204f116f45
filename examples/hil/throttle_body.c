#include "throttle_body.h"

#include <math.h>
#include <string.h>

#define COMMAND_DATA_ID 20752
#define RIDER_DATA_ID 20848
#define STATUS_DATA_ID 20784

#define PROPORTIONAL 30.0 /* A, for an error of 1 */
#define INTEGRAL 450.0    /* A/s */
#define DERIVATIVE 0.4    /* A s */
#define CYCLE 1e-3        /* s */

static double limited(double value, double low, double high)
{
        return value < low ? low : value > high ? high : value;
}

static uint64_t little_endian(const uint8_t *data, uint8_t length)
{
        uint64_t word = 0;

        for (uint8_t i = 0; i < length && i < 8; i++)
                word |= (uint64_t)data[i] << 8 * i;
        return word;
}

static uint32_t field(uint64_t word, int start, int bits)
{
        return (uint32_t)(word >> start & ((1u << bits) - 1));
}

void throttle_body_start(struct throttle_body *body)
{
        memset(body, 0, sizeof *body);
        body->command_receiver = (struct e2e_receiver){ .data_id = COMMAND_DATA_ID, .length = 8 };
        body->rider_receiver = (struct e2e_receiver){ .data_id = RIDER_DATA_ID, .length = 6 };
        body->plate.position = body->setpoint = body->last_position = LIMP_HOME;
}

static void receive_command(struct throttle_body *body, uint64_t word, uint64_t now_us)
{
        uint32_t authority = field(word, 12, 2), opening = field(word, 14, 14); /* 0.01 % */

#ifndef PLANTED_RANGE_UNCHECKED
        if (opening > 10000)
                return;
#endif
        body->authority = (uint8_t)authority;
        body->commanded = opening * 1e-4;
        body->command_us = now_us;
        if (authority == AUTHORITY_NONE)
                body->latched = false;
}

static void receive_controls(struct throttle_body *body, uint64_t word, uint64_t now_us)
{
        uint32_t grip = field(word, 13, 10); /* 0.1 % */

        if (grip > 1000)
                return;
#ifdef PLANTED_GRIP_FROZEN
        if (!body->rider_known)
#endif
                body->grip = grip * 1e-3;
        body->rider_us = now_us;
        body->rider_known = true;
}

void throttle_body_receive(struct throttle_body *body, uint32_t identifier, const uint8_t *data,
                           uint8_t length, uint64_t now_us)
{
        uint64_t word = little_endian(data, length);

        if (identifier == COMMAND_ID && e2e_accept(&body->command_receiver, data, length))
                receive_command(body, word, now_us);
        if (identifier == RIDER_ID && e2e_accept(&body->rider_receiver, data, length))
                receive_controls(body, word, now_us);
}

static bool rider_is_heard(const struct throttle_body *body, uint64_t now_us)
{
#ifdef PLANTED_RIDER_TIMEOUT_OFF
        (void)now_us;
        return body->rider_known;
#else
        return body->rider_known && now_us - body->rider_us <= RIDER_TIMEOUT_US;
#endif
}

/* End authority without a release from the bench: it must release before it gets any again. */
static void watch(struct throttle_body *body, uint64_t now_us)
{
        bool silent = now_us - body->command_us > WATCHDOG_US;
        bool late = body->started && now_us - body->step_us > WATCHDOG_US; /* this program stood still */

#ifdef PLANTED_WATCHDOG_OFF
        silent = false;
#endif
#ifdef PLANTED_PAUSE_UNCHECKED
        late = false;
#endif
        if (body->authority == AUTHORITY_NONE)
                return;
        if (silent || late || body->faulty || !rider_is_heard(body, now_us))
                body->latched = true;
#ifdef PLANTED_LATCH_MISSING
        body->latched = silent || body->faulty;
#endif
}

static uint8_t granted(const struct throttle_body *body)
{
        return body->latched ? AUTHORITY_NONE : body->authority;
}

static double requested_opening(const struct throttle_body *body, uint64_t now_us)
{
#ifdef PLANTED_SPARK_MOVES_THROTTLE
        if (granted(body) != AUTHORITY_NONE)
                return body->commanded;
#endif
        if (granted(body) & AUTHORITY_THROTTLE)
                return body->commanded;
#ifdef PLANTED_RIDER_IGNORED
        if (body->commanded > 0.0)
                return body->commanded;
#endif
        return rider_is_heard(body, now_us) ? body->grip : 0.0;
}

/* Motor current, A: PID on the position, velocity of the setpoint fed forward; the integral stops at the limit. */
static double control(struct throttle_body *body, double setpoint_rate)
{
        double position = body->plate.position;
        double error = body->setpoint - position;
        double rate = (position - body->last_position) / CYCLE;
        double current = PROPORTIONAL * error + body->integral + DERIVATIVE * (setpoint_rate - rate);
#ifdef PLANTED_CURRENT_LIMIT_MISSING
        double most = 25.0;
#else
        double most = MOST_CURRENT;
#endif

        body->last_position = position;
#ifndef PLANTED_INTEGRAL_MISSING
        if (fabs(current) < most)
                body->integral += INTEGRAL * CYCLE * error;
#endif
        return limited(current, -most, most);
}

/* A plate that does not follow its setpoint makes the device faulty, until it is started again. */
static void check_following(struct throttle_body *body, uint64_t now_us)
{
        if (fabs(body->setpoint - body->plate.position) <= FOLLOWING_ERROR)
                body->following_us = 0;
        else if (body->following_us == 0)
                body->following_us = now_us;
#ifndef PLANTED_FOLLOWING_UNCHECKED
        else if (now_us - body->following_us > FOLLOWING_US)
                body->faulty = true;
#endif
}

static void write_status(struct throttle_body *body, uint64_t now_us, uint8_t *status)
{
        uint64_t opening = (uint64_t)lround(body->plate.position * 1e4);
        int64_t current = lround(body->current / 0.025);
        uint64_t word = (uint64_t)granted(body) << 12 | opening << 14 |
                        ((uint64_t)current & 0x7FF) << 28 | (uint64_t)body->faulty << 39 |
                        (now_us & 0xFFFFFF) << 40;

#ifdef PLANTED_TIME_STUCK
        word &= 0xFFFFFFFFFF;
#endif
        for (int i = 0; i < STATUS_LENGTH; i++)
                status[i] = (uint8_t)(word >> 8 * i);
        e2e_protect(status, STATUS_LENGTH, STATUS_DATA_ID, body->counter);
#ifndef PLANTED_COUNTER_STUCK
        body->counter = (uint8_t)((body->counter + 1) % E2E_PERIOD);
#endif
}

bool throttle_body_step(struct throttle_body *body, uint64_t now_us, uint8_t status[STATUS_LENGTH])
{
        double before = body->setpoint, most = SETPOINT_RATE * CYCLE, opening;

        watch(body, now_us);
        opening = limited(requested_opening(body, now_us), 0.0, 1.0);
#ifdef PLANTED_RATE_LIMIT_MISSING
        most = 1.0;
#endif
        body->setpoint = limited(opening, before - most, before + most);
        body->current = body->faulty ? 0.0 : control(body, (body->setpoint - before) / CYCLE);
        plate_move(&body->plate, body->current);
        check_following(body, now_us);
        body->step_us = now_us;
        body->started = true;
        write_status(body, now_us, status);
#ifdef PLANTED_SENDS_TOO_RARELY
        return now_us / CYCLE_US % 4 == 0;
#else
        return true;
#endif
}

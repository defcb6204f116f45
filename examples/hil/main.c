/* throttle_body INTERFACE: the throttle body on SocketCAN, in cycles of 1 ms. SIGUSR1 jams the plate. */
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sched.h>
#include <time.h>
#include <unistd.h>

#include "throttle_body.h"

#define CYCLE_NS (1000L * CYCLE_US)
#define SECOND_NS 1000000000L

static volatile sig_atomic_t jammed, ended;

static void on_signal(int number)
{
        if (number == SIGUSR1)
                jammed = 1;
        else
                ended = 1;
}

static int failure(const char *what, const char *interface)
{
        fprintf(stderr, "throttle_body: %s on %s: %s\n", what, interface, strerror(errno));
        return 1;
}

static int open_can(const char *interface)
{
        struct sockaddr_can address = { .can_family = AF_CAN };
        struct can_filter filters[] = {
                { COMMAND_ID, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG },
                { RIDER_ID, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG },
        };
        int can = socket(AF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW);

        address.can_ifindex = (int)if_nametoindex(interface);
        if (can < 0 || address.can_ifindex == 0 ||
            setsockopt(can, SOL_CAN_RAW, CAN_RAW_FILTER, filters, sizeof filters) != 0 ||
            bind(can, (struct sockaddr *)&address, sizeof address) != 0)
                return -1;
        return can;
}

static uint64_t now_us(void)
{
        struct timespec now;

        clock_gettime(CLOCK_MONOTONIC, &now);
        return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static void receive_all(int can, struct throttle_body *body)
{
        struct can_frame frame;

        while (read(can, &frame, sizeof frame) == (ssize_t)sizeof frame)
                throttle_body_receive(body, frame.can_id, frame.data, frame.can_dlc, now_us());
}

static void send_status(int can, const uint8_t *status)
{
        struct can_frame frame = { .can_id = STATUS_ID, .can_dlc = STATUS_LENGTH };

        memcpy(frame.data, status, STATUS_LENGTH);
        if (write(can, &frame, sizeof frame) < 0)
                return; /* a full queue loses the frame; the counter shows it */
}

/* Wait for the next cycle; cycles that are over already are left out. */
static void wait_for_cycle(struct timespec *deadline)
{
        struct timespec now;

        do {
                deadline->tv_nsec += CYCLE_NS;
                if (deadline->tv_nsec >= SECOND_NS) {
                        deadline->tv_nsec -= SECOND_NS;
                        deadline->tv_sec++;
                }
                clock_gettime(CLOCK_MONOTONIC, &now);
        } while (now.tv_sec > deadline->tv_sec ||
                 (now.tv_sec == deadline->tv_sec && now.tv_nsec > deadline->tv_nsec));
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, deadline, NULL) == EINTR && !ended)
                ;
}

static void become_real_time(void)
{
        struct sched_param priority = { .sched_priority = 50 };

        if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0 || mlockall(MCL_CURRENT) != 0)
                fprintf(stderr, "throttle_body: no real-time rights; cycles may be late\n");
}

int main(int count, char **arguments)
{
        struct throttle_body body;
        struct timespec deadline;
        uint8_t status[STATUS_LENGTH];
        int can;

        if (count != 2) {
                fprintf(stderr, "usage: throttle_body INTERFACE\n");
                return 2;
        }
        can = open_can(arguments[1]);
        if (can < 0)
                return failure("no CAN socket", arguments[1]);
        signal(SIGUSR1, on_signal);
        signal(SIGINT, on_signal);
        signal(SIGTERM, on_signal);
        become_real_time();
        throttle_body_start(&body);
        clock_gettime(CLOCK_MONOTONIC, &deadline);
        while (!ended) {
                wait_for_cycle(&deadline);
                body.plate.jammed = jammed;
                receive_all(can, &body);
                if (throttle_body_step(&body, now_us(), status))
                        send_status(can, status);
        }
        close(can);
        return 0;
}

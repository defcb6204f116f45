/* Gives a user-mode Linux a time of its own, in which its processor is FASTER times faster.
 *
 * Its system calls take 5 to 10 times as long as a real kernel's, it has one processor, and the
 * machine gives that to others as well. A bench that keeps a real processor busy at 1 kHz cannot
 * keep its pace there. Loaded with LD_PRELOAD, this replaces the kernel's only clock: its time is
 * the processor time that the kernel and its programs really got, divided by FASTER; and where all
 * of them wait, time goes on to the next appointment at once. Inside nothing can tell.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>

#define SECOND 1000000000L /* ns, as all times below */
#define BOOT SECOND        /* processor time in which the kernel measures itself, at its own pace */
#define NEXT(name) \
        static __typeof__(&name) next; \
        if (!next) next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static long skipped;     /* time in which everybody waited */
static long worked;      /* processor time of the programs, each read when it has stopped */
static timer_t alarm_clock;
static long appointment; /* own time at which it rings, 0 for never */

static long faster(void)
{
        static long times;

        if (times == 0)
                times = getenv("FASTER") ? atol(getenv("FASTER")) : 1;
        return times;
}

static long nanoseconds(struct timespec time) { return time.tv_sec * SECOND + time.tv_nsec; }

static struct timespec timespec(long ns) { return (struct timespec){ ns / SECOND, ns % SECOND }; }

static long real_time(clockid_t clock)
{
        struct timespec now = { 0, 0 };
        NEXT(clock_gettime);

        return next(clock, &now) == 0 ? nanoseconds(now) : 0;
}

static long busy(void) { return real_time(CLOCK_THREAD_CPUTIME_ID) + worked; }

static long pace(void) { return busy() < BOOT ? 1 : faster(); }

static long own_time(void)
{
        static long origin;
        long now = busy(), booting = now < BOOT ? now : BOOT;

        if (origin == 0)
                origin = real_time(CLOCK_MONOTONIC);
        return origin + skipped + booting + (now - booting) / faster();
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
        NEXT(clock_gettime);

        if (faster() == 1 || clock != CLOCK_MONOTONIC)
                return next(clock, now);
        *now = timespec(own_time());
        return 0;
}

/* The kernel has waited for one of its programs: here is what that took. */
pid_t waitpid(pid_t wanted, int *status, int options)
{
        static struct { pid_t process; long time; } known[256], *program;
        NEXT(waitpid);
        pid_t stopped = next(wanted, status, options);
        long time;

        if (faster() == 1 || stopped <= 0)
                return stopped;
        time = real_time((clockid_t)(~(unsigned)stopped << 3 | 2)); /* of that process */
        program = &known[stopped % 256];
        if (program->process == stopped && program->time < time)
                worked += time - program->time;
        program->process = stopped;
        program->time = time;
        return stopped;
}

static int set_timer(timer_t timer, int flags, long first, long period, struct itimerspec *old)
{
        NEXT(timer_settime);

        return next(timer, flags, &(struct itimerspec){ timespec(period), timespec(first) }, old);
}

/* A real timer that rings too early does no harm: the kernel looks at its clock and sets it anew. */
int timer_settime(timer_t timer, int flags, const struct itimerspec *new, struct itimerspec *old)
{
        long first = nanoseconds(new->it_value), period = nanoseconds(new->it_interval);

        alarm_clock = timer;
        appointment = first ? own_time() + first : 0;
        return set_timer(timer, flags, first * pace(), period * pace(), old);
}

/* Everybody waits: it is as late as it would be when the alarm rings, and that rings at once. */
int sigsuspend(const sigset_t *mask)
{
        NEXT(sigsuspend);
        long left = appointment ? appointment - own_time() : 0;

        if (faster() > 1 && left > 0) {
                skipped += left;
                set_timer(alarm_clock, 0, 1, 0, NULL);
        }
        return next(mask);
}

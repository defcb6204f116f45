/* Lets time pass SLOW_MOTION times slower for a user-mode Linux and all that runs on it.
 *
 * Its system calls take 5 to 10 times as long as a real kernel's, and it has one processor. A bench
 * that keeps one of those busy at 1 kHz cannot keep its own pace there. Loaded with LD_PRELOAD, this
 * stretches the kernel's only clock and its only timer by the same factor: inside nothing can tell,
 * except that the processor seems that much faster.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <time.h>

static const long SECOND = 1000000000; /* ns */

static long slowness(void)
{
        static long times;

        if (times == 0)
                times = getenv("SLOW_MOTION") ? atol(getenv("SLOW_MOTION")) : 1;
        return times;
}

static struct timespec scaled(struct timespec time, long multiply, long divide)
{
        __int128 total = ((__int128)time.tv_sec * SECOND + time.tv_nsec) * multiply;
        long ns = (long)((total + divide - 1) / divide); /* a timer that runs never reads zero */

        return (struct timespec){ ns / SECOND, ns % SECOND };
}

static struct itimerspec scaled_timer(const struct itimerspec *timer, long multiply, long divide)
{
        return (struct itimerspec){ scaled(timer->it_interval, multiply, divide),
                                    scaled(timer->it_value, multiply, divide) };
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
        static int (*next)(clockid_t, struct timespec *);
        int status;

        if (!next)
                next = dlsym(RTLD_NEXT, "clock_gettime");
        status = next(clock, now);
        if (status == 0 && clock == CLOCK_MONOTONIC)
                *now = scaled(*now, 1, slowness());
        return status;
}

int timer_settime(timer_t timer, int flags, const struct itimerspec *new, struct itimerspec *old)
{
        static int (*next)(timer_t, int, const struct itimerspec *, struct itimerspec *);
        struct itimerspec slow = scaled_timer(new, slowness(), 1);
        int status;

        if (!next)
                next = dlsym(RTLD_NEXT, "timer_settime");
        status = next(timer, flags, &slow, old);
        if (status == 0 && old)
                *old = scaled_timer(old, 1, slowness());
        return status;
}

int timer_gettime(timer_t timer, struct itimerspec *left)
{
        static int (*next)(timer_t, struct itimerspec *);
        int status;

        if (!next)
                next = dlsym(RTLD_NEXT, "timer_gettime");
        status = next(timer, left);
        if (status == 0)
                *left = scaled_timer(left, 1, slowness());
        return status;
}

/* Lets an older user-mode Linux run on processors whose registers outgrew it.
 *
 * Linux takes a process's extended registers (x87, SSE, AVX, AVX-512, then AMX's tiles) only whole:
 * PTRACE_SETREGSET with fewer bytes than the processor has ends in EFAULT. User-mode Linux before
 * 6.13 keeps 2696 bytes, which is everything up to AVX-512, and so cannot start a process where the
 * processor also has AMX (11008 bytes). Loaded with LD_PRELOAD, this completes what it writes: the
 * registers beyond its 2696 bytes are told to be in their initial state, as they are, because a
 * process must ask for AMX and user-mode Linux passes no such request on.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

enum { WIDEST = 1 << 16, HEADER = 512 };        /* bytes; the header follows the legacy area */
static const unsigned long KEPT = (1UL << 10) - 1; /* features that lie within the 2696 bytes */

typedef long (*ptrace_function)(enum __ptrace_request, ...);

static char registers[WIDEST] __attribute__((aligned(64)));
static size_t width;

static size_t width_of_all_registers(ptrace_function next, pid_t process)
{
        struct iovec all = { registers, WIDEST };
        return next(PTRACE_GETREGSET, process, NT_X86_XSTATE, &all) == 0 ? all.iov_len : 0;
}

static long set_whole(ptrace_function next, pid_t process, const struct iovec *part)
{
        unsigned long features;

        if (width == 0)
                width = width_of_all_registers(next, process);
        if (width <= part->iov_len)
                return next(PTRACE_SETREGSET, process, NT_X86_XSTATE, part);
        memset(registers, 0, width);
        memcpy(registers, part->iov_base, part->iov_len);
        memcpy(&features, registers + HEADER, sizeof features);
        features &= KEPT;
        memcpy(registers + HEADER, &features, sizeof features);
        return next(PTRACE_SETREGSET, process, NT_X86_XSTATE, &(struct iovec){ registers, width });
}

long ptrace(enum __ptrace_request request, ...)
{
        static ptrace_function next;
        va_list arguments;
        pid_t process;
        void *address, *data;

        va_start(arguments, request);
        process = va_arg(arguments, pid_t);
        address = va_arg(arguments, void *);
        data = va_arg(arguments, void *);
        va_end(arguments);
        if (!next)
                next = (ptrace_function)dlsym(RTLD_NEXT, "ptrace");
        if (request == PTRACE_SETREGSET && address == (void *)NT_X86_XSTATE)
                return set_whole(next, process, data);
        return next(request, process, address, data);
}

/* A PTRACE_SETREGSET for User-Mode Linux on processors whose extended state is larger than it knows.
 *
 * UML 6.1 keeps 2696 bytes of a process' extended state (NT_X86_XSTATE). Where the processor has more (AMX: 11 kB), the
 * host's kernel refuses to set a part of it (EFAULT), and UML dies at boot: "ptrace set fp regs failed, errno = 14".
 * This ptrace, put before the C library's by LD_PRELOAD, then lays the given part over the whole state and sets that.
 * The rest stays as it is: no process of the guest ever gets the leave to use it.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

typedef long ptrace_function(enum __ptrace_request, ...);

static char whole[1 << 16] __attribute__((aligned(64)));

static long set_over_whole(ptrace_function *next, pid_t pid, void *kind, const struct iovec *part)
{
    struct iovec state = {whole, sizeof whole};
    if (next(PTRACE_GETREGSET, pid, kind, &state) != 0)
        return -1;
    memcpy(whole, part->iov_base, part->iov_len < state.iov_len ? part->iov_len : state.iov_len);
    return next(PTRACE_SETREGSET, pid, kind, &state);
}

long ptrace(enum __ptrace_request request, ...)
{
    static ptrace_function *next;
    if (next == NULL)
        next = (ptrace_function *)dlsym(RTLD_NEXT, "ptrace");

    va_list arguments;
    va_start(arguments, request);
    pid_t pid = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    long result = next(request, pid, address, data);
    int refused = result == -1 && errno == EFAULT;
    if (refused && request == PTRACE_SETREGSET && address == (void *)NT_X86_XSTATE)
        return set_over_whole(next, pid, address, data);
    return result;
}

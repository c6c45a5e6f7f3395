/*
 * Lets User-Mode Linux run on processors with a large register state (AMX).
 *
 * Linux accepts PTRACE_SETREGSET for NT_X86_XSTATE only with the complete state of the processor, 11 kB with AMX.
 * User-Mode Linux 6.1 sends the first 2.7 kB and ends with a fatal signal. Preloaded, this library completes the state:
 * it reads the present one and replaces its beginning. The layout is the processor's standard format, so the
 * beginning means the same in both.
 */
#define _GNU_SOURCE
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

long ptrace(enum __ptrace_request request, ...)
{
	static char state[1 << 16] __attribute__((aligned(64)));
	va_list list;
	va_start(list, request);
	long pid = va_arg(list, int);
	void *address = va_arg(list, void *), *data = va_arg(list, void *);
	va_end(list);

	if (request == PTRACE_SETREGSET && (unsigned long)address == NT_X86_XSTATE) {
		struct iovec *given = data, whole = { state, sizeof state };
		if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, NT_X86_XSTATE, &whole) == 0 && given->iov_len < whole.iov_len) {
			memcpy(state, given->iov_base, given->iov_len);
			return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, NT_X86_XSTATE, &whole);
		}
	}
	/* The raw system call stores the word of a PEEK request instead of returning it. */
	if (request >= PTRACE_PEEKTEXT && request <= PTRACE_PEEKUSER) {
		long word;
		long result = syscall(SYS_ptrace, request, pid, address, &word);
		return result == 0 ? word : result;
	}
	return syscall(SYS_ptrace, request, pid, address, data);
}

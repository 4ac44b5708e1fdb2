/*
 * User-Mode Linux 6.1 writes a process's floating point registers back as it knows them. A kernel on
 * a processor with AMX takes them only as a whole, tiles included, and the guest dies of it as soon
 * as it starts init. What it knows is written over the whole here; the rest stays as it is.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { PEEK_FIRST = 1, PEEK_LAST = 3, GET_REGISTERS = 0x4204, SET_REGISTERS = 0x4205 };
enum { XSTATE = 0x202 };

static char whole_state[1 << 16];

long ptrace(int request, ...)
{
	va_list rest;
	va_start(rest, request);
	long process = va_arg(rest, int);
	void *address = va_arg(rest, void *), *data = va_arg(rest, void *);
	va_end(rest);
	if (request >= PEEK_FIRST && request <= PEEK_LAST) {
		long word;
		if (syscall(SYS_ptrace, request, process, address, &word) < 0)
			return -1;
		errno = 0;
		return word;
	}
	if (request == SET_REGISTERS && (long)address == XSTATE) {
		struct iovec *known = data, whole = {whole_state, sizeof whole_state};
		if (syscall(SYS_ptrace, GET_REGISTERS, process, address, &whole) == 0 &&
		    whole.iov_len > known->iov_len) {
			memcpy(whole_state, known->iov_base, known->iov_len);
			data = &whole;
			return syscall(SYS_ptrace, request, process, address, data);
		}
	}
	return syscall(SYS_ptrace, request, process, address, data);
}

"""Confinement of this process before it works on untrusted data: no files, no network, no other programs.

| system | enforced by | against |
|---|---|---|
| Linux, x86-64 and arm64 | seccomp: a list of permitted system calls | all others: files, sockets, processes |
| every POSIX system | resource limits | new descriptors, thus files and sockets; memory, CPU time, processes |
| every system | an audit hook of Python | Python code that opens files, sockets or programs, or executes code |

The first two are enforced by the kernel, need no privileges, and cannot be taken back. The third is only a second
wall: native code could pass it. On Windows it is the only one, beside the parent's limit of time.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
import sys
from typing import Any

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

PR_SET_SECCOMP, PR_SET_NO_NEW_PRIVS, SECCOMP_MODE_FILTER = 22, 38, 2
"""Of prctl(2)."""
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050001, 0x80000000
"""Results of a filter: proceed; fail with EPERM; end the process (linux/seccomp.h)."""
LOAD, EQUAL, GREATER_EQUAL, RETURN = 0x20, 0x15, 0x35, 0x06
"""Instructions of BPF (linux/bpf_common.h)."""
NUMBER_AT, ARCHITECTURE_AT = 0, 4
"""Offsets in struct seccomp_data."""
X32_BIT = 0x40000000
"""System calls of x86-64 from this number on belong to another interface."""

_X86_64 = {
    "read": 0, "write": 1, "close": 3, "fstat": 5, "poll": 7, "lseek": 8, "mmap": 9, "mprotect": 10, "munmap": 11,
    "brk": 12, "rt_sigaction": 13, "rt_sigprocmask": 14, "rt_sigreturn": 15, "writev": 20, "sched_yield": 24,
    "mremap": 25, "madvise": 28, "getpid": 39, "exit": 60, "getcwd": 79, "gettimeofday": 96, "getrusage": 98,
    "times": 100, "sigaltstack": 131, "gettid": 186, "futex": 202, "clock_gettime": 228, "clock_nanosleep": 230,
    "exit_group": 231, "getrandom": 318, "membarrier": 324, "rseq": 334,
}  # fmt: skip
_ARM64 = {
    "getcwd": 17, "close": 57, "lseek": 62, "read": 63, "write": 64, "writev": 66, "ppoll": 73, "fstat": 80,
    "exit": 93,
    "exit_group": 94, "futex": 98, "clock_gettime": 113, "clock_nanosleep": 115, "sched_yield": 124,
    "sigaltstack": 132, "rt_sigaction": 134, "rt_sigprocmask": 135, "rt_sigreturn": 139, "times": 153,
    "getrusage": 165,
    "gettimeofday": 169, "getpid": 172, "gettid": 178, "brk": 214, "munmap": 215, "mremap": 216, "mmap": 222,
    "mprotect": 226, "madvise": 233, "getrandom": 278, "membarrier": 283, "rseq": 293,
}  # fmt: skip
SYSTEM_CALLS = {"x86_64": (0xC000003E, _X86_64), "aarch64": (0xC00000B7, _ARM64)}
"""By machine: the number of its interface (linux/audit.h), and the permitted system calls."""
_REFUSED_EVENTS = (
    "open",
    "exec",
    "import",
    "socket.",
    "subprocess.",
    "os.",
    "shutil.",
    "ctypes.",
    "glob.",
    "tempfile.",
)
"""Begins of the audit events of Python that are refused."""


def confine(memory: int, cpu_seconds: int) -> list[str]:
    """Confine this process for the rest of its life; return by what: 'system calls', 'resources', 'Python'.

    memory: bytes that it may allocate beyond what it has now. cpu_seconds: time of computing until it is ended. All
    that will be needed must be imported before.
    """
    found = []
    if resource is not None:
        _limit_resources(memory, cpu_seconds)
        found.append("resources")
    if sys.platform == "linux" and _permit_system_calls():
        found.append("system calls")
    sys.addaudithook(_refuse)
    return [*found, "Python"]


def _limit_resources(memory: int, cpu_seconds: int) -> None:
    limits = {
        "RLIMIT_AS": _address_space() + memory,
        "RLIMIT_CPU": cpu_seconds,
        "RLIMIT_NOFILE": 0,
        "RLIMIT_FSIZE": 0,
        "RLIMIT_NPROC": 0,
        "RLIMIT_CORE": 0,
    }
    for name, limit in limits.items():
        kind = getattr(resource, name, None)
        if kind is not None:
            _lower(kind, limit)


def _lower(kind: int, limit: int) -> None:
    """Set a limit; a lower one of the owner stays."""
    hard = resource.getrlimit(kind)[1]
    limit = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
    resource.setrlimit(kind, (limit, limit))


def _address_space() -> int:
    """Return the bytes of address space that this process uses; 0 where that is unknown."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123
            return int(file.read().split()[0]) * resource.getpagesize()
    except OSError:
        return 0


def _permit_system_calls() -> bool:
    """Install the filter of system calls; return False where the kernel or the machine has none."""
    if platform.machine() not in SYSTEM_CALLS or struct.calcsize("P") != 8:
        return False
    program = filter_program(*SYSTEM_CALLS[platform.machine()])
    code = ctypes.create_string_buffer(program)
    described = struct.pack("HxxxxxxQ", len(program) // 8, ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        return False
    return libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.c_char_p(described), 0, 0) == 0


def filter_program(interface: int, permitted: dict[str, int]) -> bytes:
    """Return the BPF program that permits the given system calls of one interface and refuses all others."""
    calls = sorted(permitted.values())
    tests = [_step(EQUAL, call, len(calls) - place, 0) for place, call in enumerate(calls)]
    return b"".join(
        [
            _step(LOAD, ARCHITECTURE_AT),
            _step(EQUAL, interface, 1, 0),
            _step(RETURN, KILL),
            _step(LOAD, NUMBER_AT),
            _step(GREATER_EQUAL, X32_BIT, len(calls), 0),
            *tests,
            _step(RETURN, REFUSE),
            _step(RETURN, ALLOW),
        ]
    )


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    """Return one instruction; the jumps count instructions."""
    return struct.pack("=HBBI", code, if_true, if_false, value)


def _refuse(event: str, arguments: Any) -> None:
    if event.startswith(_REFUSED_EVENTS):
        raise PermissionError(
            f"{event} {str(arguments)[:80]}: not permitted while a file of others is expanded"
        )


def child_environment() -> dict[str, str]:
    """Return the environment of a confined process: what Python needs to start, and nothing of the user's."""
    needed = ("PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "PATH", "SYSTEMROOT", "LANG", "LC_ALL")
    return {name: os.environ[name] for name in needed if name in os.environ} | {
        "PYTHONDONTWRITEBYTECODE": "1"
    }

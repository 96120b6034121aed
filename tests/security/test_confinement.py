"""A confined process has no files, no network and no programs left, neither by Python nor by the C library."""

from __future__ import annotations

import subprocess
import sys

import pytest

from chefbot.cli.robot.foreign.confinement import SYSTEM_CALLS, child_environment, filter_program

START = """
import ctypes, os, socket, sys
libc = ctypes.CDLL(None, use_errno=True)
names = "open", "socket", "fork", "execv", "unlink", "kill", "ptrace", "mkdir"
calls = {name: getattr(libc, name) for name in names}
from chefbot.cli.robot.foreign.confinement import confine
enforced = confine(100_000_000, 2)
"""
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="the filter of system calls is Linux's")


def run(code: str) -> subprocess.CompletedProcess[str]:
    """Run code in a process that has just confined itself."""
    return subprocess.run(
        [sys.executable, "-c", START + code],
        capture_output=True,
        text=True,
        timeout=60,
        env=child_environment(),
    )


@LINUX
@pytest.mark.parametrize(
    "call",
    [
        'calls["open"](b"/etc/passwd", 0)',
        'calls["open"](b"/tmp/confined", 0o101, 0o600)',
        'calls["socket"](2, 1, 0)',
        'calls["socket"](1, 1, 0)',
        'calls["fork"]()',
        'calls["execv"](b"/bin/true", None)',
        'calls["unlink"](b"/tmp/confined")',
        'calls["mkdir"](b"/tmp/confined", 0o700)',
        'calls["kill"](os.getppid(), 0)',
        'calls["ptrace"](0, 0, 0, 0)',
    ],
)
def test_the_kernel_refuses_system_calls_of_native_code(call: str) -> None:
    done = run(f"result = {call}\nsys.stdout.write(f'{{result}} {{enforced}}')")
    assert done.stdout == "-1 ['resources', 'system calls', 'Python']", done.stderr


@pytest.mark.parametrize(
    "code",
    [
        "open('/etc/passwd')",
        "os.system('true')",
        "os.listdir('/')",
        "os.fork()",
        "os.remove('/tmp/confined')",
        "socket.socket()",
        "socket.create_connection(('127.0.0.1', 9))",
        "__import__('subprocess').run(['true'])",
        "eval('1')",
        "exec('1')",
        "import wave",
        "ctypes.CDLL(None)",
    ],
)
def test_python_refuses_files_programs_and_network(code: str) -> None:
    done = run(f"try:\n    {code}\nexcept (OSError, ImportError):\n    sys.stdout.write('refused')")
    assert done.stdout == "refused", done.stderr


@pytest.mark.slow
def test_memory_and_computing_are_limited() -> None:
    done = run("try:\n    bytes(200_000_000)\nexcept MemoryError:\n    sys.stdout.write('refused')")
    assert done.stdout == "refused", done.stderr
    assert run("while True: pass").returncode < 0


def test_secrets_in_the_environment_are_not_inherited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_TOKEN", "hunter2")
    assert "hunter2" not in str(child_environment())


@pytest.mark.parametrize("machine", SYSTEM_CALLS)
def test_the_filter_permits_its_list_and_nothing_else(machine: str) -> None:
    """The program is run here as the kernel does, for every system call and for a foreign interface."""
    interface, permitted = SYSTEM_CALLS[machine]
    program = filter_program(interface, permitted)
    allowed = {number for number in range(600) if verdict(program, interface, number) == 0x7FFF0000}
    assert allowed == set(permitted.values())
    assert verdict(program, interface, 0x40000000) == verdict(program, interface, 0x40000001) == 0x00050001
    assert verdict(program, interface ^ 1, 0) == 0x80000000


def verdict(program: bytes, interface: int, number: int) -> int:
    """Interpret the BPF program for one system call."""
    import struct

    steps, at, value = list(struct.iter_unpack("=HBBI", program)), 0, 0
    while True:
        code, if_true, if_false, k = steps[at]
        at += 1
        if code == 0x06:
            return int(k)
        if code == 0x20:
            value = {0: number, 4: interface}[k]
        else:
            at += if_true if (value == k if code == 0x15 else value >= k) else if_false

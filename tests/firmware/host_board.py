"""The firmware's core in a shared library, whose time a test advances step by step."""

from __future__ import annotations

import ctypes
import fcntl
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_int16, c_int32, c_void_p
from functools import cache
from pathlib import Path

import pytest

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.robot.load import load_robot
from chefbot.sim import firmware
from tests.firmware.serial_lines import Message, add_checksum, parse_messages

FIRMWARE = Path(__file__).parents[2] / "firmware"
STOPPED = 3


def need(*tools: str) -> None:
    """Skip the test if a tool is not installed."""
    for tool in tools:
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")


@cache
def make(target: str, **variables: object) -> str:
    """Run a target of the firmware's Makefile once and return its output; fail the test if it fails."""
    settings = {"PYTHON": sys.executable, **variables}  # PYTHON of the environment need not have chefbot
    command = ["make", "-s", "-C", str(FIRMWARE), target, *(f"{k}={v}" for k, v in settings.items())]
    with _locked("plain" if target in ("coverage", "mutate") else "build"):
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@contextmanager
def _locked(what: str) -> Iterator[None]:
    """Let only one of the test processes at a time write the files of the build."""
    folder = FIRMWARE / "build"
    folder.mkdir(exist_ok=True)
    with (folder / f"{what}.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@cache
def library() -> ctypes.CDLL:
    """Return the library of the simulator, with the additional functions that only tests call."""
    lib: ctypes.CDLL = firmware.library()
    lib.chefbot_board_hang.argtypes = [c_void_p]
    lib.chefbot_board_imu_answers.argtypes = [c_void_p, c_int32]
    lib.chefbot_board_encoder_lines.argtypes = [c_void_p, c_int32, c_int32]
    return lib


class HostBoard:
    """A board with an error-free serial line, which counts sequence numbers and collects messages."""

    def __init__(self, constants: dict[str, int] | None = None) -> None:
        """Create a board with constants in the order of core/robot.h, by default those of the Chefbot."""
        self.lib = library()
        self.constants = constants or {c.name: c.value for c in firmware_constants(load_robot("chefbot"))}
        values = [as_int32(v) for v in self.constants.values()]
        self.handle = self.lib.chefbot_board_create((c_int32 * len(values))(*values), len(values))
        assert self.handle
        self.sequence = 0
        self.messages: list[Message] = []
        self._rng = random.Random(1)
        self._buffer = ctypes.create_string_buffer(65536)

    def __del__(self) -> None:
        if getattr(self, "handle", None):
            self.lib.chefbot_board_destroy(self.handle)

    @property
    def state(self) -> firmware.FirmwareState:
        state = firmware.FirmwareState()
        self.lib.chefbot_board_get(self.handle, state)
        return state

    def write(self, data: bytes) -> None:
        assert self.lib.chefbot_board_write(self.handle, data, len(data))

    def read(self) -> bytes:
        count = self.lib.chefbot_board_read(self.handle, self._buffer, len(self._buffer))
        return ctypes.string_at(self._buffer, count)

    def send_command(self, letter: str, *numbers: int) -> None:
        """Send a command with the next sequence number."""
        self.sequence = (self.sequence + 1) % 65536
        self.write(add_checksum(" ".join([letter, str(self.sequence), *map(str, numbers)])))

    def imu(self, *raw: int) -> None:
        """Set the registers of the IMU: ax ay az temperature gx gy gz."""
        self.lib.chefbot_board_imu(self.handle, (c_int16 * 7)(*raw))

    def set_imu_at_rest(self) -> None:
        """Set the IMU's registers to those of a level board at rest, with noise."""
        noise = [self._rng.randint(-3, 3) for _ in range(6)]
        self.imu(noise[0], noise[1], 8192 + noise[2], -3920, *noise[3:])

    def advance(self, ms: float = 10.0) -> list[Message]:
        """Advance the board's time in control steps and return the messages that it has sent meanwhile."""
        start = len(self.messages)
        left = round(ms * 1000)
        while left > 0:
            self.set_imu_at_rest()
            part = min(left, 10_000)
            self.lib.chefbot_board_advance(self.handle, part)
            left -= part
        self.messages += parse_messages(self.read())
        return self.messages[start:]

    def open_session(self) -> Message:
        """Open a session by the handshake and return the answer."""
        self.write(add_checksum("v 7 1"))
        (answer,) = [m for m in self.advance(10) if m.letter == "v"]
        self.sequence = int(answer.fields[-2])
        return answer

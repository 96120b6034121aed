"""The firmware's core in a shared library, driven step by step."""

from __future__ import annotations

import ctypes
import fcntl
import os
import random
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_int16, c_int32, c_void_p
from functools import cache
from pathlib import Path

import pytest

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.robot.load import load_robot
from chefbot.sim import firmware
from tests.firmware.lines import Message, framed, messages

FIRMWARE = Path(__file__).parents[2] / "firmware"
STOPPED = 3


def need(*tools: str) -> None:
    """Skips the test where a tool is missing."""
    for tool in tools:
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")


@cache
def make(target: str, **variables: object) -> str:
    """Output of the firmware's Makefile, run once; fails the test where it fails."""
    command = ["make", "-s", "-C", str(FIRMWARE), target, *(f"{k}={v}" for k, v in variables.items())]
    with _alone("plain" if target in ("coverage", "mutate") else "build"):
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@contextmanager
def _alone(what: str) -> Iterator[None]:
    """Tests run in several processes; one of them at a time writes these files."""
    folder = FIRMWARE / "build"
    folder.mkdir(exist_ok=True)
    with (folder / f"{what}.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@cache
def library() -> ctypes.CDLL:
    """The simulator's, with what only tests do to a board."""
    lib: ctypes.CDLL = firmware.library()
    lib.chefbot_board_hang.argtypes = [c_void_p]
    lib.chefbot_board_imu_answers.argtypes = [c_void_p, c_int32]
    lib.chefbot_board_encoder_lines.argtypes = [c_void_p, c_int32, c_int32]
    return lib


class HostBoard:
    """A board with an ideal computer on its line: counts sequences, collects messages."""

    def __init__(self, constants: dict[str, int] | None = None) -> None:
        """`constants` by name in the order of core/robot.h; those of the Chefbot if left out."""
        self.lib = library()
        self.constants = constants or {c.name: c.value for c in firmware_constants(load_robot("chefbot"))}
        values = [as_int32(v) for v in self.constants.values()]
        self.handle = self.lib.chefbot_board_create((c_int32 * len(values))(*values), len(values))
        assert self.handle
        self.sequence = 0
        self.heard: list[Message] = []
        self._chance = random.Random(1)
        self._room = ctypes.create_string_buffer(65536)

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
        count = self.lib.chefbot_board_read(self.handle, self._room, len(self._room))
        return ctypes.string_at(self._room, count)

    def say(self, letter: str, *numbers: int) -> None:
        """A command with the next sequence number."""
        self.sequence = (self.sequence + 1) % 65536
        self.write(framed(" ".join([letter, str(self.sequence), *map(str, numbers)])))

    def imu(self, *raw: int) -> None:
        """ax ay az temperature gx gy gz."""
        self.lib.chefbot_board_imu(self.handle, (c_int16 * 7)(*raw))

    def live_imu(self) -> None:
        """Level and at rest, with the noise of a real one."""
        noise = [self._chance.randint(-3, 3) for _ in range(6)]
        self.imu(noise[0], noise[1], 8192 + noise[2], -3920, *noise[3:])

    def advance(self, ms: float = 10.0) -> list[Message]:
        """Goes on, step by step; the messages of that time."""
        start = len(self.heard)
        left = round(ms * 1000)
        while left > 0:
            self.live_imu()
            part = min(left, 10_000)
            self.lib.chefbot_board_advance(self.handle, part)
            left -= part
        self.heard += messages(self.read())
        return self.heard[start:]

    def shake_hands(self) -> Message:
        """Opens a session."""
        self.write(framed("v 7 1"))
        (answer,) = [m for m in self.advance(10) if m.letter == "v"]
        self.sequence = int(answer.fields[-2])
        return answer

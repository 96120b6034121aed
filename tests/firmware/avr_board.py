"""The ATmega2560's program in simavr, driven like HostBoard."""

from __future__ import annotations

import random
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.firmware.host_board import FIRMWARE, make, need
from tests.firmware.lines import framed

SIMAVR_HEADER = Path("/usr/include/simavr/sim_avr.h")


class AvrState(NamedTuple):
    """What `run` answers."""

    duty: tuple[int, int]
    drivers: int
    steps: int
    longest_step: int
    """Cycles from the first instruction of a control step to its last, encoder interrupts within included."""
    resets: int
    said: bytes


def build_avr() -> tuple[Path, Path]:
    """Bench and program; skips where a tool is missing."""
    need("make", "avr-g++", "gcc", "pkg-config")
    if not SIMAVR_HEADER.exists():
        pytest.skip("simavr is not installed (Debian: libsimavr-dev libelf-dev)")
    make("build/mega.elf")
    make("build/avr_board")
    return FIRMWARE / "build" / "avr_board", FIRMWARE / "build" / "mega.elf"


class AvrBoard:
    """A lockstep bench; `close` ends it."""

    def __init__(self) -> None:
        bench, program = build_avr()
        assert shutil.which(str(bench))
        self._process = subprocess.Popen(
            [str(bench), str(program)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.sequence = 0
        self.said = b""
        self._chance = random.Random(3)

    def close(self) -> None:
        assert self._process.stdin and self._process.stdout
        self._process.stdin.close()
        assert self._process.wait(30) == 0
        self._process.stdout.close()

    def ask(self, command: str) -> str:
        """Answer to one command of the bench."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    def write(self, data: bytes) -> None:
        assert self.ask(f"tx {data.hex()}") == "ok"

    def say(self, letter: str, *numbers: int) -> None:
        """A command with the next sequence number."""
        self.sequence = (self.sequence + 1) % 65536
        self.write(framed(" ".join([letter, str(self.sequence), *map(str, numbers)])))

    def live_imu(self) -> None:
        """Level, at rest, with noise."""
        noise = [self._chance.randint(-3, 3) for _ in range(6)]
        raw = [noise[0], noise[1], 8192 + noise[2], -3920, *noise[3:]]
        assert self.ask("imu " + " ".join(map(str, raw))) == "ok"

    def run(self, us: int) -> AvrState:
        answer = self.ask(f"run {us}").split()
        left, right, drivers, steps, longest, resets = map(int, answer[:6])
        said = b"" if answer[6] == "-" else bytes.fromhex(answer[6])
        self.said += said
        return AvrState((left, right), drivers, steps, longest, resets, said)

    def shake_hands(self) -> None:
        """Opens a session; the answer names its first sequence."""
        self.write(framed("v 7 1"))
        self.said = b""
        for _ in range(5):
            self.live_imu()
            self.run(10_000)
        (answer,) = [line for line in self.said.splitlines() if line.startswith(b"v ")]
        self.sequence = int(answer.split(b"*")[0].split(b" ")[-2])

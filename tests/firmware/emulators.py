"""Programs of microcontrollers in emulators, with the same methods as HostBoard."""

from __future__ import annotations

import json
import math
import os
import random
import subprocess
import zlib
from pathlib import Path
from typing import NamedTuple

import pytest

from chefbot.board.firmware_image import with_robot
from chefbot.cli.board.image import IMAGES
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import write_into_folder
from tests.firmware.host_board import FIRMWARE, make, need
from tests.firmware.serial_lines import add_checksum
from tests.support.waiting import PATIENCE

BUILD = FIRMWARE / "build"
SIMAVR_HEADER = Path("/usr/include/simavr/sim_avr.h")
BOOT_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex")
"""The boot loader that a new Mega contains."""


def image_for(robot: str, board: str) -> Path:
    """Return the package's program for a board with a robot, by its name or file, filled in."""
    model = load_robot(robot)
    data = with_robot((IMAGES / f"{board}.bin").read_bytes(), model, board)
    path = BUILD / "images" / f"{board}_{zlib.crc32(data):08x}.bin"
    write_into_folder(path, data)
    return path


class EmulatorState(NamedTuple):
    """Outputs at the end of `run`, and the bytes sent in it."""

    duty: tuple[int, int]
    drivers: int
    steps: int
    longest_step: int
    """Cycles of the longest control step, including encoder interrupts during it."""
    resets: int
    sent: bytes


class BoardEmulator:
    """A microcontroller's program in its emulator, in lockstep with the test; `close` ends it."""

    name: str
    link = "uart"
    """Where the computer is connected: uart or usb."""
    battery_adc: int
    """Reading of the analogue-digital converter at the initial 12 V."""
    echo_jitter_us: int
    """Largest error of the measured width of a pulse."""

    def __init__(self, command: list[str], folder: Path, robot: Robot) -> None:
        """robot: its program was made for it; what is not wired as usual is passed to the emulator."""
        wiring = {
            "CHEFBOT_DRIVER_INPUTS": robot.driver.inputs,
            "CHEFBOT_ENABLE_DIAG": str(int(robot.driver.enable_diag)),
            "CHEFBOT_PINS": json.dumps(robot.board.pins.by_name()),
            "CHEFBOT_LINK": self.link,
        }
        pipe, environment = subprocess.PIPE, {**os.environ, **wiring}
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, text=True, cwd=folder, env=environment
        )
        self.robot = robot
        self.sequence = 0
        self.sent = b""
        self._rng = random.Random(3)

    def battery_mv(self, adc: int) -> int:
        """Return the millivolts that the program calculates from a reading."""
        raise NotImplementedError

    def battery_command(self, adc: int) -> int:
        """Return the millivolts to set in the emulator for a reading."""
        raise NotImplementedError

    def readable_duty(self, duty: int) -> int:
        """Return the value of `duty` after rounding to the timer's compare register."""
        raise NotImplementedError

    def close(self) -> None:
        assert self._process.stdin and self._process.stdout
        self._process.stdin.close()
        assert self._process.wait(PATIENCE) == 0
        self._process.stdout.close()

    def request(self, command: str) -> str:
        """Send a command to the emulator and return its answer."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    def write(self, data: bytes) -> None:
        if data:
            assert self.request(f"tx {data.hex()}") == "ok"

    def send_command(self, letter: str, *numbers: int) -> None:
        """Send a command with the next sequence number."""
        self.sequence = (self.sequence + 1) % 65536
        self.write(add_checksum(" ".join([letter, str(self.sequence), *map(str, numbers)])))

    def set_imu_at_rest(self) -> None:
        """Set the IMU's registers to those of a level board at rest, with noise."""
        noise = [self._rng.randint(-3, 3) for _ in range(6)]
        raw = [noise[0], noise[1], 8192 + noise[2], -3920, *noise[3:]]
        assert self.request("imu " + " ".join(map(str, raw))) == "ok"

    def run(self, us: int) -> EmulatorState:
        answer = self.request(f"run {us}").split()
        left, right, drivers, steps, longest, resets = map(int, answer[:6])
        sent = b"" if answer[6] == "-" else bytes.fromhex(answer[6])
        self.sent += sent
        return EmulatorState((left, right), drivers, steps, longest, resets, sent)

    def open_session(self) -> None:
        """Open a session by the handshake, whose answer contains the first sequence number."""
        self.write(add_checksum("v 7 1"))
        self.sent = b""
        for _ in range(5):
            self.set_imu_at_rest()
            self.run(10_000)
        (answer,) = [line for line in self.sent.splitlines() if line.startswith(b"v ")]
        self.sequence = int(answer.split(b"*")[0].split(b" ")[-2])


class MegaEmulator(BoardEmulator):
    """An ATmega2560 in simavr."""

    name = "mega2560"
    battery_adc = 613
    echo_jitter_us = 4  # a hardware counter of 4 us

    def __init__(self, *boot_loader: Path, robot: str = "chefbot") -> None:
        need("make", "gcc", "pkg-config")
        if not SIMAVR_HEADER.exists():
            pytest.skip("simavr is not installed (Debian: libsimavr-dev libelf-dev)")
        program = image_for(robot, "mega")
        make("build/avr_board")
        command = [BUILD / "avr_board", program, *boot_loader]
        super().__init__(list(map(str, command)), BUILD, load_robot(robot))

    def battery_mv(self, adc: int) -> int:
        return adc * 625 // 32

    def battery_command(self, adc: int) -> int:
        return math.ceil((adc + 0.5) * 4 * 5000 / 1023)

    def readable_duty(self, duty: int) -> int:
        size = abs(duty) * 4 // 5 * 5 // 4
        return size if duty > 0 else -size


class MegaWithBootLoader(MegaEmulator):
    """A Mega whose boot loader first waits for a new program; `reset` has the effect of opening its port."""

    name = "mega2560 with its boot loader"

    def __init__(self) -> None:
        if not BOOT_LOADER.exists():
            pytest.skip("the Mega's boot loader is not installed (Debian: arduino-core-avr)")
        super().__init__(BOOT_LOADER)
        self.run(1_000_000)  # a reset within the boot loader's first run makes simavr thirty times slower

    def reset(self) -> None:
        assert self.request("reset") == "ok"


class PicoEmulator(BoardEmulator):
    """An RP2040 in rp2040js."""

    name = "rp2040"
    battery_adc = 2613
    echo_jitter_us = 20  # measured by an interrupt that another one may delay

    def __init__(self, robot: str = "chefbot") -> None:
        need("node")
        if not (BUILD / "node_modules" / "rp2040js").exists():
            pytest.skip("rp2040js is not installed (make -C firmware rp2040js)")
        binary = image_for(robot, "pico")
        program = FIRMWARE / "test" / "pico_board.mjs"
        super().__init__(["node", str(program), str(binary)], BUILD, load_robot(robot))

    def battery_mv(self, adc: int) -> int:
        return adc * 4703 >> 10

    def battery_command(self, adc: int) -> int:
        return round(adc * 4703 / 1024)

    def readable_duty(self, duty: int) -> int:
        size = round(abs(duty) * 12 // 5 * 1000 / 2400)
        return size if duty > 0 else -size


class PicoAtUsb(PicoEmulator):
    """An RP2040 in rp2040js, with the computer at its USB connector."""

    link = "usb"

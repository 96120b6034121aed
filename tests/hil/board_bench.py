"""A hardware-in-the-loop bench: a board with simulated wheels and IMU, whose serial line is a pseudo-terminal."""

from __future__ import annotations

import math
import os
import random
import threading
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from chefbot.board.firmware_constants import firmware_constants
from chefbot.robot.load import load_robot
from tests.hil.boards import LockstepBoard
from tests.support.waiting import PATIENCE, wait_for

SERIAL_PERIOD_US, STEP_US = 2_000, 10_000
"""Periods of serial input and output, and of the simulated wheels and IMU, which is that of the control step."""
LAG, FRICTION = 0.13, 0.05
"""Time constant of the motors in seconds, and friction as a share of full duty."""
ROBOT = load_robot("chefbot")
NO_LOAD = {constant.name: constant.value for constant in firmware_constants(ROBOT)}["no_load"]
"""Ticks/s at full duty."""


class Sample(NamedTuple):
    """Duty at the end of a time step."""

    time_us: int
    duty: tuple[int, int]


class Wheels:
    """Two wheels with first-order motors and friction."""

    def __init__(self) -> None:
        self.speed = [0.0, 0.0]
        """Ticks/s."""
        self._position = [0.0, 0.0]
        self.ticks = [0, 0]

    def step(self, duty: tuple[int, int], drivers: bool) -> tuple[int, int]:
        """Advance by one control step and return the ticks of each wheel in it."""
        moved = (self._turn(0, duty[0] * drivers), self._turn(1, duty[1] * drivers))
        self.ticks = [before + more for before, more in zip(self.ticks, moved, strict=True)]
        return moved

    def _turn(self, wheel: int, duty: int) -> int:
        """Advance one wheel: static friction holds a slow wheel, dynamic friction slows a fast one."""
        pull, before, dt = duty / 1000.0, self.speed[wheel], STEP_US * 1e-6
        held = abs(pull) <= FRICTION
        drag = math.copysign(FRICTION, before if abs(before) >= 1.0 else pull)
        after = before + ((pull - drag) * NO_LOAD - before) * (1.0 - math.exp(-dt / LAG))
        stopped = held and (abs(before) < 1.0 or before * after < 0.0)
        self.speed[wheel] = 0.0 if stopped else after
        self._position[wheel] += self.speed[wheel] * dt
        return math.floor(self._position[wheel]) - self.ticks[wheel]

    @property
    def yaw_rate(self) -> float:
        """Yaw rate of the robot, rad/s."""
        return (self.speed[1] - self.speed[0]) * ROBOT.metres_per_tick / ROBOT.wheels.separation


def _wait() -> None:
    time.sleep(0.1)


class BoardBench:
    """Runs a board in a thread at a real-time factor of 1; on a slow machine its time is slower, without jumps."""

    def __init__(self, board: LockstepBoard, path: Path) -> None:
        self.board, self.path = board, path
        self._controller, self._terminal = os.openpty()
        tty.setraw(self._terminal)
        os.set_blocking(self._controller, False)
        path.symlink_to(os.ttyname(self._terminal))
        self.wheels = Wheels()
        self.reversed: int | None = None
        """The wheel whose encoder counts in the wrong direction, if any."""
        self.time_us = 0
        self.samples = [Sample(0, (0, 0))]
        self._drivers = False
        self._rng = random.Random(7)
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and raise the error that has ended it, if any."""
        self._ending.set()
        self._thread.join()
        self.board.close()
        for end in (self._controller, self._terminal):
            os.close(end)
        if self._error is not None:
            raise self._error

    def apply(self, change: Callable[[LockstepBoard], None]) -> None:
        """Change an input of the board between two time steps."""
        with self._lock:
            change(self.board)

    def stops_after(self, fault: Callable[[], None], turn: Callable[[], object] = _wait) -> float:
        """Return the board's time from a fault until both duties stay zero for a second, ms.

        The board's time does not advance while `fault` runs. `turn` makes the wheels turn again where a busy computer
        was late with a command, so that the board has stopped them.
        """
        began_us = self._apply_while_driven(fault, turn)
        wait_for(
            lambda: self.time_us > began_us + 1_200_000 or self._error is not None,
            "a second of the board's time",
        )
        later = [sample for sample in list(self.samples) if sample.time_us > began_us]
        driven = [sample.time_us for sample in later if any(sample.duty)]
        assert later[-1].duty == (0, 0), "the wheels have not stopped"
        return (max(driven, default=began_us) + SERIAL_PERIOD_US - began_us) / 1000.0

    def _apply_while_driven(self, fault: Callable[[], None], turn: Callable[[], object]) -> int:
        give_up = time.monotonic() + PATIENCE
        while time.monotonic() < give_up:
            with self._lock:
                if max(self.samples[-1].duty) > 0:
                    fault()
                    return self.time_us
            turn()
        raise AssertionError("the wheels do not turn")

    # -- methods of the thread

    def _run(self) -> None:
        try:
            due = time.monotonic()
            while not self._ending.is_set():
                with self._lock:
                    self._step()
                due = max(due + SERIAL_PERIOD_US * 1e-6, time.monotonic())
                time.sleep(max(0.0005, due - time.monotonic()))
        except Exception as error:
            self._error = error

    def _step(self) -> None:
        with suppress(BlockingIOError):  # the computer has sent nothing
            self.board.write(os.read(self._controller, 4096))
        if self.time_us % STEP_US == 0:
            self._step_wheels_and_imu()
        output = self.board.run(SERIAL_PERIOD_US)
        self.time_us += SERIAL_PERIOD_US
        self._drivers = output.drivers
        self.samples.append(Sample(self.time_us, output.duty))
        with suppress(BlockingIOError):  # without a reader the rest is lost, as on a serial line
            os.write(self._controller, output.sent)

    def _step_wheels_and_imu(self) -> None:
        for wheel, moved in enumerate(self.wheels.step(self.samples[-1].duty, self._drivers)):
            if moved:
                self.board.turn(wheel, -moved if wheel == self.reversed else moved)
        noise = [self._rng.randint(-3, 3) for _ in range(6)]
        yaw_rate = round(math.degrees(self.wheels.yaw_rate) * 65.5)  # of the MPU-6050 at 500 deg/s
        self.board.imu((noise[0], noise[1], 8192 + noise[2], -3920, noise[3], noise[4], noise[5] + yaw_rate))

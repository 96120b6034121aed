"""A board on a desk: its line is a pty, its wheels turn as its duty says, and its time is the board's own."""

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
from tests.support.waiting import wait_for

PIECE_US, STEP_US = 2_000, 10_000
"""The line is served so often; the world outside the board moves once a control step."""
LAG, FRICTION = 0.13, 0.05
"""Seconds, and share of full duty."""
ROBOT = load_robot("chefbot")
NO_LOAD = {constant.name: constant.value for constant in firmware_constants(ROBOT)}["no_load"]
"""Ticks/s at full duty."""


class Sample(NamedTuple):
    """At the end of a piece of time."""

    time_us: int
    duty: tuple[int, int]


class Wheels:
    """Two motors of first order with friction, and the ticks that they have turned."""

    def __init__(self) -> None:
        self.speed = [0.0, 0.0]
        """Ticks/s."""
        self._place = [0.0, 0.0]
        self.ticks = [0, 0]

    def step(self, duty: tuple[int, int], drivers: bool) -> tuple[int, int]:
        """One control step; the ticks that each wheel turned in it."""
        moved = (self._turn(0, duty[0] * drivers), self._turn(1, duty[1] * drivers))
        self.ticks = [before + more for before, more in zip(self.ticks, moved, strict=True)]
        return moved

    def _turn(self, wheel: int, duty: int) -> int:
        """Friction holds what creeps, and slows the rest."""
        pull, before, dt = duty / 1000.0, self.speed[wheel], STEP_US * 1e-6
        held = abs(pull) <= FRICTION
        drag = math.copysign(FRICTION, before if abs(before) >= 1.0 else pull)
        after = before + ((pull - drag) * NO_LOAD - before) * (1.0 - math.exp(-dt / LAG))
        stopped = held and (abs(before) < 1.0 or before * after < 0.0)
        self.speed[wheel] = 0.0 if stopped else after
        self._place[wheel] += self.speed[wheel] * dt
        return math.floor(self._place[wheel]) - self.ticks[wheel]

    @property
    def yaw_rate(self) -> float:
        """rad/s of the robot."""
        return (self.speed[1] - self.speed[0]) * ROBOT.metres_per_tick / ROBOT.wheels.separation


class Desk:
    """Keeps to the wall clock, but never hurries: on a slow machine the board's time is slower, not jumpy."""

    def __init__(self, board: LockstepBoard, path: Path) -> None:
        self.board, self.path = board, path
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        path.symlink_to(os.ttyname(self._theirs))
        self.wheels = Wheels()
        self.reversed: int | None = None
        """The wheel whose encoder counts backwards."""
        self.time_us = 0
        self.samples = [Sample(0, (0, 0))]
        self._drivers = False
        self._chance = random.Random(7)
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="desk", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Raises what went wrong in the thread."""
        self._ending.set()
        self._thread.join()
        self.board.close()
        for end in (self._ours, self._theirs):
            os.close(end)
        if self._error is not None:
            raise self._error

    def happen(self, event: Callable[[LockstepBoard], None]) -> None:
        """Something is done to the board between two pieces of its time."""
        with self._lock:
            event(self.board)

    def stops_after(self, fault: Callable[[], None]) -> float:
        """Milliseconds of the board's time from a fault, while which its time stands, until both duties are zero.

        For good: a second later they still are.
        """
        with self._lock:
            assert max(self.samples[-1].duty) > 0, "it does not drive"
            fault()
            began_us = self.time_us
        wait_for(
            lambda: self.time_us > began_us + 1_200_000 or self._error is not None, "a second of the board's"
        )
        later = [sample for sample in list(self.samples) if sample.time_us > began_us]
        driven = [sample.time_us for sample in later if any(sample.duty)]
        assert later[-1].duty == (0, 0), "it drives on"
        return (max(driven, default=began_us) + PIECE_US - began_us) / 1000.0

    # -- in the thread

    def _run(self) -> None:
        try:
            due = time.monotonic()
            while not self._ending.is_set():
                with self._lock:
                    self._piece()
                due = max(due + PIECE_US * 1e-6, time.monotonic())
                time.sleep(max(0.0005, due - time.monotonic()))
        except Exception as error:
            self._error = error

    def _piece(self) -> None:
        with suppress(BlockingIOError):  # the computer says nothing
            self.board.write(os.read(self._ours, 4096))
        if self.time_us % STEP_US == 0:
            self._surroundings()
        put_out = self.board.run(PIECE_US)
        self.time_us += PIECE_US
        self._drivers = put_out.drivers
        self.samples.append(Sample(self.time_us, put_out.duty))
        with suppress(BlockingIOError):  # nobody reads: what does not fit is lost, as on a wire
            os.write(self._ours, put_out.said)

    def _surroundings(self) -> None:
        for wheel, moved in enumerate(self.wheels.step(self.samples[-1].duty, self._drivers)):
            if moved:
                self.board.turn(wheel, -moved if wheel == self.reversed else moved)
        noise = [self._chance.randint(-3, 3) for _ in range(6)]
        turning = round(math.degrees(self.wheels.yaw_rate) * 65.5)  # of the MPU-6050 at 500 deg/s
        self.board.imu((noise[0], noise[1], 8192 + noise[2], -3920, noise[3], noise[4], noise[5] + turning))

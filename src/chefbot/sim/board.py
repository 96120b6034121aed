"""The motor board of the simulated robot: wheel speeds in, duty out, at 100 Hz, with a watchdog."""

from __future__ import annotations

from chefbot.control.wheel_pid import WheelPid
from chefbot.robot.spec import Robot
from chefbot.sim.simulation import STEP_NS, Simulation

PERIOD_NS = 10_000_000
WATCHDOG_NS = 200_000_000
"""A command older than this is a stop, whatever the computer does."""


class Board:
    """Holds the wheel speeds that were commanded last."""

    def __init__(self, robot: Robot, simulation: Simulation) -> None:
        self._simulation = simulation
        self._radius = robot.wheel_radius
        self._wheels = (WheelPid(robot), WheelPid(robot))
        self._ticks = simulation.wheel_ticks()
        self._target = (0.0, 0.0)
        self._commanded_ns = -WATCHDOG_NS

    def command(self, left: float, right: float) -> None:
        """Rim speeds in m/s."""
        self._target = (left / self._radius, right / self._radius)
        self._commanded_ns = self._simulation.time_ns

    def run_until(self, time_ns: int) -> None:
        """Physics and control up to `time_ns`."""
        while self._simulation.time_ns < time_ns:
            if self._simulation.time_ns % PERIOD_NS == 0:
                self._control()
            self._simulation.step()

    def _control(self) -> None:
        stale = self._simulation.time_ns - self._commanded_ns > WATCHDOG_NS
        target = (0.0, 0.0) if stale else self._target
        ticks = self._simulation.wheel_ticks()
        moved = (ticks[0] - self._ticks[0], ticks[1] - self._ticks[1])
        self._ticks = ticks
        duty = [
            wheel.update(speed, count, PERIOD_NS / 1e9)
            for wheel, speed, count in zip(self._wheels, target, moved, strict=True)
        ]
        self._simulation.set_duty(duty[0], duty[1])


assert PERIOD_NS % STEP_NS == 0

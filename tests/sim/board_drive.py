"""Drives a simulated robot through its simulated board, with dead reckoning on the board's ticks."""

from __future__ import annotations

import math

from chefbot.control.kinematics import wheel_speeds
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.idl.message import Message
from chefbot.robot.load import load_robot
from chefbot.sim.board import EXCHANGE_PERIOD_NS, SimulatedBoard
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
SECOND = 1_000_000_000
COMMAND_PERIOD_NS = 50_000_000
"""The drive base commands the wheels at 20 Hz."""


def robot_in(
    world: str, profile: str = "perfect", seed: int = 0, name: str = ""
) -> tuple[Simulation, SimulatedBoard]:
    robot = load_robot(name) if name else ROBOT
    sim = Simulation(robot, load_world(world), profile, seed)  # type: ignore[arg-type]
    return sim, SimulatedBoard(robot, sim)


def drive(board: SimulatedBoard, left: float, right: float, seconds: float) -> list[Message]:
    """Command speeds of the wheels at the ground, m/s, at 20 Hz and return the board's messages."""
    messages = []
    radius = board.robot.wheel_radius
    for _ in range(round(seconds * SECOND / COMMAND_PERIOD_NS)):
        board.command(left / radius, right / radius)
        messages += board.run_until(board.now_ns + COMMAND_PERIOD_NS)
    return messages


class DeadReckoningDriver:
    """Drives to poses by dead reckoning on the board's ticks."""

    def __init__(self, sim: Simulation, board: SimulatedBoard) -> None:
        self.board, self.robot, self.pose = board, sim.robot, SE2(0.0, 0.0, 0.0)
        self.ticks: WheelTicks | None = None

    def step(self, v: float, w: float) -> None:
        """Drive for 20 ms with the velocities v and w in m/s and rad/s, which the board ramps."""
        self.board.command(*wheel_speeds(v, w, self.robot))
        for message in self.board.run_until(self.board.now_ns + EXCHANGE_PERIOD_NS):
            if isinstance(message, WheelTicks):
                self.integrate(message)

    def integrate(self, now: WheelTicks) -> None:
        before, self.ticks = self.ticks or now, now
        left, right = now.left - before.left, now.right - before.right
        angle = (right - left) * self.robot.metres_per_tick / self.robot.wheels.separation
        distance = (left + right) / 2 * self.robot.metres_per_tick
        self.pose = self.pose @ SE2(distance * math.cos(angle / 2), distance * math.sin(angle / 2), angle)

    def turn_to(self, yaw: float) -> None:
        for _ in range(1000):
            error = wrap(yaw - self.pose.yaw)
            if abs(error) < 0.002:
                break
            self.step(0.0, math.copysign(min(1.0, 2.0 * abs(error) + 0.02), error))
        for _ in range(25):
            self.step(0.0, 0.0)

    def drive_to(self, x: float, y: float) -> None:
        yaw = math.atan2(y - self.pose.y, x - self.pose.x)
        for _ in range(5000):
            ahead = SE2(x, y, yaw).between(self.pose)
            if ahead.x > -0.003:
                break
            self.step(min(0.3, math.sqrt(0.4 * -ahead.x) + 0.01), -2.0 * ahead.y - 2.0 * ahead.yaw)
        for _ in range(25):
            self.step(0.0, 0.0)

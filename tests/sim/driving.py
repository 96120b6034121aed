"""A simulated robot driven through its board, and dead reckoning on what the board tells."""

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
BEAT_NS = 50_000_000
"""The node that commands the wheels does so at 20 Hz."""


def robot_in(
    world: str, profile: str = "perfect", seed: int = 0, name: str = ""
) -> tuple[Simulation, SimulatedBoard]:
    robot = load_robot(name) if name else ROBOT
    sim = Simulation(robot, load_world(world), profile, seed)  # type: ignore[arg-type]
    return sim, SimulatedBoard(robot, sim)


def drive(board: SimulatedBoard, left: float, right: float, seconds: float) -> list[Message]:
    """Speeds of the wheels at the ground, m/s, repeated as a node does; the board's messages meanwhile."""
    told = []
    radius = board.robot.wheel_radius
    for _ in range(round(seconds * SECOND / BEAT_NS)):
        board.command(left / radius, right / radius)
        told += board.run_until(board.now_ns + BEAT_NS)
    return told


class Walker:
    """Dead reckoning on the ticks that the board tells, and legs by it."""

    def __init__(self, sim: Simulation, board: SimulatedBoard) -> None:
        self.board, self.robot, self.pose = board, sim.robot, SE2(0.0, 0.0, 0.0)
        self.ticks: WheelTicks | None = None

    def go(self, v: float, w: float) -> None:
        """20 ms at the speeds v and w; ramps are the board's."""
        self.board.command(*wheel_speeds(v, w, self.robot))
        for message in self.board.run_until(self.board.now_ns + EXCHANGE_PERIOD_NS):
            if isinstance(message, WheelTicks):
                self.count(message)

    def count(self, now: WheelTicks) -> None:
        before, self.ticks = self.ticks or now, now
        left, right = now.left - before.left, now.right - before.right
        angle = (right - left) * self.robot.metres_per_tick / self.robot.wheels.separation
        way = (left + right) / 2 * self.robot.metres_per_tick
        self.pose = self.pose @ SE2(way * math.cos(angle / 2), way * math.sin(angle / 2), angle)

    def turn_to(self, yaw: float) -> None:
        for _ in range(1000):
            error = wrap(yaw - self.pose.yaw)
            if abs(error) < 0.002:
                break
            self.go(0.0, math.copysign(min(1.0, 2.0 * abs(error) + 0.02), error))
        for _ in range(25):
            self.go(0.0, 0.0)

    def drive_to(self, x: float, y: float) -> None:
        yaw = math.atan2(y - self.pose.y, x - self.pose.x)
        for _ in range(5000):
            ahead = SE2(x, y, yaw).between(self.pose)
            if ahead.x > -0.003:
                break
            self.go(min(0.3, math.sqrt(0.4 * -ahead.x) + 0.01), -2.0 * ahead.y - 2.0 * ahead.yaw)
        for _ in range(25):
            self.go(0.0, 0.0)

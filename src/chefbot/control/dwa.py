"""The Dynamic Window Approach for a disk-shaped differential robot (Fox, Burgard & Thrun 1997).

Every twist that the base allows is a candidate, and its trajectory begins with the ramp that leads to it. The
window of the paper, what can be reached within one period, is thereby kept in each trajectory's first period,
but a robot of gentle acceleration is not judged as if it had to stay in that window for ever.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.control.controller import Command, Status
from chefbot.control.dwa_kernel import best_twist, nearest_on_path
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalChecker, GoalParams
from chefbot.maths.angles import wrap
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.motion_limits import Limits

GENTLE = 0.5
"""Share of the acceleration that planned braking uses; the rest is for surprises."""
LOOK_AHEAD = 0.25
"""Metres along the path to the point that tells the direction to turn to."""
ALIGNED = 0.2
"""Radians at which turning in place towards the path ends."""
WINDOW_EXTRA = 0.4
"""Metres of path beyond what the trajectory can reach that are compared with it."""


class Dwa:
    """Follows a path within the robot's limits and never commands what it could not stop from in time.

    Far off in heading it turns in place; at the goal it turns to the goal's heading and stays REACHED.
    """

    def __init__(
        self, limits: Limits, params: DwaParams | None = None, goal: GoalParams | None = None
    ) -> None:
        self.limits = limits
        self.params = params or DwaParams()
        self._goal_checker = GoalChecker(goal)
        self._path = np.zeros((0, 3))
        self._at = 0
        self._turning = False
        p = self.params
        self._weights = np.array(
            [p.path_weight, p.goal_weight, p.heading_weight, p.obstacle_weight, p.change_weight]
        )

    def set_path(self, path: NDArray[np.float64], *, same_goal: bool = False) -> None:
        """Follow these poses (n, 3). A new path to the same goal keeps the goal latched."""
        if not same_goal:
            self._goal_checker.reset()
        self._path, self._at = np.ascontiguousarray(path, np.float64), 0

    def command(self, pose: SE2, twist: tuple[float, float], costmap: Costmap) -> Command:
        """The twist to ramp to; pose, path and costmap in one frame, `twist` where the base's ramp is now."""
        if not len(self._path):
            return Command(*self._brake(twist), Status.NO_PATH)
        goal = SE2.of(self._path[-1])
        if self._goal_checker.near(pose, goal):
            return self._align(pose, twist, goal)
        self._advance(pose)
        ahead = self._point_ahead()
        off = wrap(math.atan2(ahead[1] - pose.y, ahead[0] - pose.x) - pose.yaw)
        self._turning = abs(off) > (ALIGNED if self._turning else self.params.rotate_from)
        if self._turning:
            return self._rotate(off)
        return self._drive(pose, twist, costmap)

    def _advance(self, pose: SE2) -> None:
        """The nearest pose of the path, searched from the last one on, so that a U-turn is not cut short."""
        end = self._at + self._count(self.limits.speed * self.params.sim_time + WINDOW_EXTRA)
        self._at += nearest_on_path(self._path[self._at : end], pose.x, pose.y)[0]

    def _count(self, metres: float) -> int:
        """Poses of the path in so many metres, at least 2."""
        spacing = math.hypot(*(self._path[1, :2] - self._path[0, :2])) if len(self._path) > 1 else 1.0
        return max(2, math.ceil(metres / max(spacing, 1e-3)) + 1)

    def _point_ahead(self) -> NDArray[np.float64]:
        return self._path[min(self._at + self._count(LOOK_AHEAD) - 1, len(self._path) - 1)]

    def _align(self, pose: SE2, twist: tuple[float, float], goal: SE2) -> Command:
        if self._goal_checker.turned(pose, goal):
            return Command(*self._brake(twist), Status.REACHED)
        return self._rotate(wrap(goal.yaw - pose.yaw))

    def _rotate(self, angle: float) -> Command:
        """In place by `angle`, at a rate from which it can stop in time; the limiter behind takes care of ramps."""
        a = self.limits.turn_acceleration
        rate = min(self.limits.turn, math.sqrt(2.0 * GENTLE * a * abs(angle)))
        w = math.copysign(rate, angle)
        part = self.limits.scale(0.0, w)
        return Command(0.0, w * part, Status.RUNNING)

    def _brake(self, twist: tuple[float, float]) -> tuple[float, float]:
        dv, dw = (
            self.limits.acceleration * self.params.period,
            self.limits.turn_acceleration * self.params.period,
        )
        v, w = twist
        return math.copysign(max(abs(v) - dv, 0.0), v), math.copysign(max(abs(w) - dw, 0.0), w)

    def _targets(self, remaining: float) -> NDArray[np.float64]:
        """Twists (n, 2) to ramp to, finer near straight on; none so fast that the goal would be overrun."""
        top, p = self.limits, self.params
        fast = min(top.speed, math.sqrt(2.0 * GENTLE * top.acceleration * remaining))
        share = np.linspace(-1.0, 1.0, p.w_samples | 1)
        v, w = np.linspace(0.0, fast, p.v_samples), top.turn * share * np.abs(share)
        pairs = np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2)
        rim = pairs[:, 0] + np.abs(pairs[:, 1]) * top.separation / 2
        return np.ascontiguousarray(pairs[rim <= top.wheel_speed + 1e-9])

    def _drive(self, pose: SE2, twist: tuple[float, float], costmap: Costmap) -> Command:
        p, corner = self.params, np.array([costmap.origin_x, costmap.origin_y, 0.0])
        ahead = self._path[self._at : self._at + self._count(self.limits.speed * p.sim_time + WINDOW_EXTRA)]
        if len(ahead) < 2:
            ahead = self._path[-2:] if len(self._path) > 1 else np.repeat(self._path, 2, axis=0)
        ahead = ahead - corner
        ahead[-1, 2] = math.atan2(
            *(ahead[-1, 1::-1] - ahead[-2, 1::-1])
        )  # the goal's own heading comes later
        remaining = pose.distance(SE2.of(self._path[-1]))
        twists = self._targets(remaining)
        chosen = best_twist(
            costmap.cells,
            costmap.resolution,
            pose.array() - corner,
            twists,
            np.array(twist),
            ahead,
            remaining,
            p.sim_time,
            p.period,
            np.array([self.limits.acceleration, self.limits.turn_acceleration]),
            self.limits.speed,
            p.slowing,
            self._weights,
        )
        if chosen < 0:
            return Command(*self._brake(twist), Status.BLOCKED)
        v, w = (float(x) for x in twists[chosen])
        stands = v <= 1e-3 and abs(w) <= 0.02
        return Command(v, w, Status.BLOCKED if stands else Status.RUNNING)

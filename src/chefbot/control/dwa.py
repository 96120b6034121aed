"""The Dynamic Window Approach for a differential drive robot (Fox, Burgard & Thrun 1997).

Every twist within the velocity limits is sampled, and its trajectory begins with the acceleration ramp that leads
to it. The paper's dynamic window (the velocities reachable within one period) thereby holds in each trajectory's
first period, but a robot with low acceleration is not judged as if it had to stay in that window forever.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.control.controller import ComparedTwists, ControllerCommand, ControllerStatus
from chefbot.control.dwa_kernel import nearest_on_path, score_twists
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalChecker, GoalParams
from chefbot.control.people_cost import NOBODY, NearbyPeople
from chefbot.control.rotation import PLANNED_BRAKING_FRACTION, rotation_rate
from chefbot.maths.angles import wrap
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.motion_limits import Limits

LOOKAHEAD_DISTANCE = 0.25
"""Distance along the path to the point that the robot rotates towards, m."""
ALIGNED_ANGLE = 0.2
"""Heading error below which rotating in place towards the path ends, rad."""
PATH_WINDOW_MARGIN = 0.4
"""Length of path beyond the reach of a trajectory that is compared with it, m."""


class DwaController:
    """Follows a path within the robot's limits and commands only velocities from which it can stop in time.

    With a large heading error it rotates in place; at the goal it rotates to the goal's heading and stays REACHED.
    A robot that is not a disc rotates in place only where its footprint is free on the way.
    """

    def __init__(
        self, limits: Limits, params: DwaParams | None = None, goal: GoalParams | None = None
    ) -> None:
        self.limits = limits
        self.params = params or DwaParams()
        self._goal_checker = GoalChecker(goal)
        self._path = np.zeros((0, 3))
        self._nearest = 0
        self._rotating = False
        self.candidates: ComparedTwists | None = None
        """What the last command was chosen from, None if it followed from the path alone."""
        p = self.params
        self._weights = np.array(
            [
                p.path_weight,
                p.goal_weight,
                p.heading_weight,
                p.obstacle_weight,
                p.change_weight,
                p.people_weight,
            ]
        )

    def set_path(self, path: NDArray[np.float64], *, same_goal: bool = False) -> None:
        """Set the path to follow, poses (n, 3); a new path to the same goal keeps the goal latched."""
        if not same_goal:
            self._goal_checker.reset()
        self._path, self._nearest = np.ascontiguousarray(path, np.float64), 0

    def command(
        self, pose: SE2, twist: tuple[float, float], costmap: Costmap, people: NearbyPeople = NOBODY
    ) -> ControllerCommand:
        """Compute the twist to ramp to.

        Pose, path, costmap and people are in one frame; `twist` is the present value of the base's velocity ramp.
        """
        self.candidates = None
        if not len(self._path):
            return ControllerCommand(*self._brake(twist), ControllerStatus.NO_PATH)
        # within the goal tolerance: only the heading remains
        goal = SE2.of(self._path[-1])
        if self._goal_checker.position_reached(pose, goal):
            return self._rotate_to_goal_heading(pose, twist, goal, costmap)
        self._update_nearest_pose(pose)
        # large heading error: rotate in place, with hysteresis
        ahead = self._lookahead_point()
        heading_error = wrap(math.atan2(ahead[1] - pose.y, ahead[0] - pose.x) - pose.yaw)
        self._rotating = abs(heading_error) > (ALIGNED_ANGLE if self._rotating else self.params.rotate_from)
        if self._rotating and _can_rotate(pose, heading_error, costmap):
            return self._rotate(heading_error)
        return self._drive(pose, twist, costmap, people)

    def _update_nearest_pose(self, pose: SE2) -> None:
        """Update the nearest pose of the path, searching from the last one on so that a U-turn is not cut short."""
        end = self._nearest + self._poses_in(self.limits.speed * self.params.sim_time + PATH_WINDOW_MARGIN)
        self._nearest += nearest_on_path(self._path[self._nearest : end], pose.x, pose.y)[0]

    def _poses_in(self, distance: float) -> int:
        """Return the number of poses within a distance along the path, at least 2."""
        spacing = math.hypot(*(self._path[1, :2] - self._path[0, :2])) if len(self._path) > 1 else 1.0
        return max(2, math.ceil(distance / max(spacing, 1e-3)) + 1)

    def _lookahead_point(self) -> NDArray[np.float64]:
        return self._path[min(self._nearest + self._poses_in(LOOKAHEAD_DISTANCE) - 1, len(self._path) - 1)]

    def _rotate_to_goal_heading(
        self, pose: SE2, twist: tuple[float, float], goal: SE2, costmap: Costmap
    ) -> ControllerCommand:
        if self._goal_checker.heading_reached(pose, goal):
            return ControllerCommand(*self._brake(twist), ControllerStatus.REACHED)
        angle = wrap(goal.yaw - pose.yaw)
        if not _can_rotate(pose, angle, costmap):
            return ControllerCommand(*self._brake(twist), ControllerStatus.BLOCKED)
        return self._rotate(angle)

    def _rotate(self, angle: float) -> ControllerCommand:
        return ControllerCommand(0.0, rotation_rate(angle, self.limits), ControllerStatus.RUNNING)

    def _brake(self, twist: tuple[float, float]) -> tuple[float, float]:
        dv, dw = (
            self.limits.acceleration * self.params.period,
            self.limits.angular_acceleration * self.params.period,
        )
        v, w = twist
        return math.copysign(max(abs(v) - dv, 0.0), v), math.copysign(max(abs(w) - dw, 0.0), w)

    def _sample_twists(self, remaining: float) -> NDArray[np.float64]:
        """Sample the twists (n, 2) to ramp to, denser near w = 0 and slow enough to stop at the goal."""
        limits, p = self.limits, self.params
        # the speed from which planned braking stops within the remaining distance: v^2 = 2 a d
        max_v = min(limits.speed, math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * limits.acceleration * remaining))
        # quadratic spacing of w samples small turn rates more densely
        fraction = np.linspace(-1.0, 1.0, p.w_samples | 1)
        v, w = np.linspace(0.0, max_v, p.v_samples), limits.angular_speed * fraction * np.abs(fraction)
        twists = np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2)
        # keep twists within the speed limit of the outer wheel
        outer_wheel_speed = twists[:, 0] + np.abs(twists[:, 1]) * limits.separation / 2
        return np.ascontiguousarray(twists[outer_wheel_speed <= limits.wheel_speed + 1e-9])

    def _drive(
        self, pose: SE2, twist: tuple[float, float], costmap: Costmap, people: NearbyPeople
    ) -> ControllerCommand:
        # the section of path that trajectories are compared with, relative to the costmap's origin
        p, origin = self.params, np.array([costmap.origin_x, costmap.origin_y, 0.0])
        ahead = self._path[
            self._nearest : self._nearest
            + self._poses_in(self.limits.speed * p.sim_time + PATH_WINDOW_MARGIN)
        ]
        if len(ahead) < 2:
            ahead = self._path[-2:] if len(self._path) > 1 else np.repeat(self._path, 2, axis=0)
        ahead = ahead - origin
        # the heading at the end is the direction of the path; the goal's own heading is reached in place
        ahead[-1, 2] = math.atan2(*(ahead[-1, 1::-1] - ahead[-2, 1::-1]))
        remaining = pose.distance(SE2.of(self._path[-1]))
        # score the trajectory of every sampled twist
        twists = self._sample_twists(remaining)
        scores = score_twists(
            costmap.cells,
            costmap.resolution,
            pose.array() - origin,
            twists,
            np.array(twist),
            ahead,
            remaining,
            p.sim_time,
            p.period,
            np.array([self.limits.acceleration, self.limits.angular_acceleration]),
            self.limits.speed,
            (p.slowing, p.people_slowing),
            self._weights,
            costmap.footprint,
            people.in_cells(pose, self.limits.speed * p.sim_time, p.sim_time, costmap),
            people.contact,
        )
        self.candidates = ComparedTwists(pose, twist, twists, scores, p.sim_time)
        # no admissible twist: brake
        best = int(np.argmin(scores))
        if math.isinf(scores[best]):
            return ControllerCommand(*self._brake(twist), ControllerStatus.BLOCKED)
        v, w = (float(x) for x in twists[best])
        standing = v <= 1e-3 and abs(w) <= 0.02
        return ControllerCommand(v, w, ControllerStatus.BLOCKED if standing else ControllerStatus.RUNNING)


def _can_rotate(pose: SE2, angle: float, costmap: Costmap) -> bool:
    """Return whether the footprint is free while the robot rotates in place by `angle`, or as free as it is now.

    The other way round is not an alternative: in more than half a turn the four corners sweep the same ring.
    """
    return not costmap.comes_nearer_by_rotating(pose, angle)

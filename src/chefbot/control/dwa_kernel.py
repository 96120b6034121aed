"""Rollout and scoring of the trajectories of the dynamic window (Fox, Burgard & Thrun 1997)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.control.people_cost import PROXIMITY, person_cost
from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN
from chefbot.maths.footprint_collision import lethal_distance, lethal_on_edges

MAX_COST = 252.0
"""Highest cost of a cell outside the inscribed radius of an obstacle."""
APPROACH_WEIGHT = 200.0
"""Penalty per metre by which a robot within the inscribed radius of an obstacle comes nearer to it as it leaves."""
MAX_REACH = 20.0
"""Distance from the robot in which obstacles count for that, cells."""
OVERSPEED_WEIGHT = 10.0
"""Penalty per m/s above the safe speed near obstacles; outweighs the progress gained by it."""
TIME_STEP = 0.075
"""Time between two collision checks along a trajectory, s: less than a 5 cm cell at indoor speeds."""
MIN_FORWARD_SPEED = 1e-3
"""Forward speed below which a trajectory rotates in place, m/s; a disc cannot collide by that."""


class Rollout(NamedTuple):
    """The end of a simulated trajectory, in cells, and what it met.

    distance, time: until the end. mean_cost, max_cost: of the cells; MAX_COST on average if it was blocked. people:
    mean of the cost of people, max_people: its maximum, 0 to 1. blocked: whether it ended before an obstacle.
    clearance: smallest distance from a lethal cell, at most the reach of the search.
    """

    x: float
    y: float
    yaw: float
    distance: float
    time: float
    mean_cost: float
    max_cost: int
    people: float
    max_people: float
    blocked: bool
    clearance: float


@njit(cache=True, nogil=True)
def cost_at(cells: NDArray[np.uint8], column: float, row: float) -> int:
    """Return the cost at a position in cells; unknown cells and those outside the costmap count as free."""
    r, c = math.floor(row), math.floor(column)
    if r < 0 or c < 0 or r >= cells.shape[0] or c >= cells.shape[1]:
        return 0
    cost = cells[r, c]
    return 0 if cost == UNKNOWN else int(cost)


@njit(cache=True, nogil=True)
def _ramped_step(
    twist: tuple[float, float], target: tuple[float, float], time: float, dt: float, ramp: float
) -> tuple[float, float]:
    """Return distance and rotation in a step that begins at `time`, with the twist on the ramp at its midpoint."""
    f = min(1.0, (time + dt / 2) / ramp) if ramp > 0.0 else 1.0
    return (twist[0] + f * (target[0] - twist[0])) * dt, (twist[1] + f * (target[1] - twist[1])) * dt


@njit(cache=True, nogil=True)
def roll_out(
    cells: NDArray[np.uint8],
    x: float,
    y: float,
    yaw: float,
    twist: tuple[float, float],
    target: tuple[float, float],
    ramp: float,
    end: float,
    remaining: float,
    limit: int,
    corners: NDArray[np.float64],
    touched: int,
    reach: float,
    people: NDArray[np.float64],
    distances: tuple[float, float],
) -> Rollout:
    """Simulate the base for `end` seconds while it ramps from `twist` to `target` in `ramp` seconds.

    x, y, speeds, `remaining`, `corners` (n, 2; none for a disc), `reach`, within which lethal cells are looked for,
    the states `people` (n, 7), and the two `distances` of `person_cost` are in cells. Ends early after a distance of
    `remaining` cells, before a cell of cost `limit` or more, or before more than `touched` points on the edges of the
    footprint are in lethal cells.
    """
    steps = math.ceil(end / TIME_STEP)
    if corners.shape[0]:
        # the edges of a polygon must not skip a cell
        steps = max(steps, math.ceil(end * max(abs(twist[0]), abs(target[0]))))
    dt = end / steps
    distance, time, total, max_cost, near, max_near, taken, blocked = 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0, False
    clearance = reach
    for _ in range(steps):
        ds, dyaw = _ramped_step(twist, target, time, dt, ramp)
        # exact arc: chord 2 r sin(dyaw / 2) in the mean direction
        chord = ds if abs(dyaw) < 1e-9 else ds * math.sin(dyaw / 2) / (dyaw / 2)
        next_x, next_y = x + chord * math.cos(yaw + dyaw / 2), y + chord * math.sin(yaw + dyaw / 2)
        # collision check of the new pose
        cost = cost_at(cells, next_x, next_y)
        max_cost = max(max_cost, cost)
        blocked = cost >= limit and ds > 0.0
        if corners.shape[0] and not blocked:
            blocked = lethal_on_edges(cells, next_x, next_y, yaw + dyaw, corners) > touched
        if blocked:
            break
        x, y, yaw, distance, time, total = next_x, next_y, yaw + dyaw, distance + ds, time + dt, total + cost
        if reach > 0.0:
            clearance = min(clearance, lethal_distance(cells, x, y, clearance))
        # people, where they will be then
        if people.shape[0]:
            cost_of_people = person_cost(people, x, y, time, distances[0], distances[1])
            near, max_near = near + cost_of_people, max(max_near, cost_of_people)
        taken += 1
        # the goal is reached before the simulated time is over
        if distance >= remaining:
            break
    mean = MAX_COST if blocked else total / taken
    near /= max(taken, 1)
    return Rollout(x, y, yaw, distance, time, mean, max_cost, near, max_near, blocked, clearance)


@njit(cache=True, nogil=True)
def nearest_on_path(path: NDArray[np.float64], x: float, y: float) -> tuple[int, float]:
    """Return (index, squared distance) of the pose of the path (n, 3) nearest to the point."""
    best, min_squared = 0, math.inf
    for i in range(path.shape[0]):
        dx, dy = path[i, 0] - x, path[i, 1] - y
        d = dx * dx + dy * dy
        if d < min_squared:
            best, min_squared = i, d
    return best, min_squared


@njit(cache=True, nogil=True)
def _deviation(path: NDArray[np.float64], x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Return the along-track distance (m), cross-track error (m) and absolute heading error (rad) of a pose."""
    i, squared = nearest_on_path(path, x, y)
    dx, dy = x - path[i, 0], y - path[i, 1]
    # offset in the frame of the nearest path pose: along and across its direction
    c, s = math.cos(path[i, 2]), math.sin(path[i, 2])
    along_track, cross_track = c * dx + s * dy, abs(c * dy - s * dx)
    # before the first and behind the last pose the distance to that pose counts
    if i == path.shape[0] - 1 or i == 0:
        cross_track = math.sqrt(squared) if along_track * (1 if i else -1) > 0 else cross_track
    # heading error, wrapped to (-pi, pi]
    heading_error = (yaw - path[i, 2] + math.pi) % (2 * math.pi) - math.pi
    spacing = math.hypot(path[1, 0] - path[0, 0], path[1, 1] - path[0, 1])
    return i * spacing + along_track, cross_track, abs(heading_error)


@njit(cache=True, nogil=True)
def _braking_distance(v: float, present: float, ramp: float, period: float, acceleration: float) -> float:
    """Return the distance to stop after one more period towards the speed `v`, m: v T + v^2 / (2 a)."""
    next_v = present + (v - present) * min(1.0, period / max(ramp, 1e-9))
    max_v = max(next_v, present, 0.0)
    return max_v * period + max_v * max_v / (2.0 * acceleration)


@njit(cache=True, nogil=True)
def _leaves(
    cells: NDArray[np.uint8], end: Rollout, in_inscribed: bool, touched: int, corners: NDArray[np.float64]
) -> bool:
    """Return whether a trajectory ends outside the inscribed zone and with fewer lethal points on its footprint.

    in_inscribed, touched: whether it begins in that zone, and with how many such points. True if it is blocked.
    """
    if end.blocked:
        return True
    if in_inscribed and cost_at(cells, end.x, end.y) >= INSCRIBED:
        return False
    return not (touched and lethal_on_edges(cells, end.x, end.y, end.yaw, corners) >= touched)


@njit(cache=True, nogil=True)
def _safe_speed(end: Rollout, max_speed: float, slowing: tuple[float, float]) -> float:
    """Return the speed limit near obstacles and people, m/s, linear in the maximum cost of each."""
    obstacles = slowing[0] * min(end.max_cost, MAX_COST) / MAX_COST
    return max_speed * (1.0 - max(obstacles, slowing[1] * end.max_people))


@njit(cache=True, nogil=True)
def _score(
    path: NDArray[np.float64],
    resolution: float,
    end: Rollout,
    twist: tuple[float, float],
    present_w: float,
    sim_time: float,
    safe_speed: float,
    weights: NDArray[np.float64],
) -> float:
    """Return the objective function of a trajectory that ends at `end` with `twist`; lower is better."""
    # pose error at the end, with the progress of the time that remains after reaching the goal
    along_track, cross_track, heading_error = _deviation(
        path, end.x * resolution, end.y * resolution, end.yaw
    )
    along_track += twist[0] * (sim_time - end.time) * (0.0 if end.blocked else 1.0)
    # path, progress, heading, obstacles, change of turn rate, people, and speed near obstacles
    score = weights[0] * cross_track - weights[1] * along_track + weights[2] * heading_error
    score += weights[3] * end.mean_cost / MAX_COST
    score += weights[4] * abs(twist[1] - present_w) + weights[5] * end.people
    return score + OVERSPEED_WEIGHT * max(0.0, twist[0] - safe_speed)


@njit(cache=True, nogil=True)
def _prefer_clearance(scores: NDArray[np.float64], approach: NDArray[np.float64]) -> None:
    """Penalize ways out of an inscribed zone by how near they come to an obstacle, m; infinite for all other twists.

    The lowest of their scores stays as it is, so that the robot leaves wherever it would have left without this.
    """
    ways = np.flatnonzero(np.isfinite(approach))
    if not len(ways):
        return
    penalized = scores[ways] + APPROACH_WEIGHT * approach[ways]
    scores[ways] = penalized + (scores[ways].min() - penalized.min())


@njit(cache=True, nogil=True)
def score_twists(
    cells: NDArray[np.uint8],
    resolution: float,
    pose: NDArray[np.float64],
    twists: NDArray[np.float64],
    twist: NDArray[np.float64],
    path: NDArray[np.float64],
    remaining: float,
    sim_time: float,
    period: float,
    accelerations: NDArray[np.float64],
    max_speed: float,
    slowing: tuple[float, float],
    weights: NDArray[np.float64],
    footprint: NDArray[np.float64],
    people: NDArray[np.float64],
    contact: float,
) -> NDArray[np.float64]:
    """Return the score of each (v, w) of `twists` (n, 2), lower is better, infinite if it is not admissible.

    pose, path, remaining: metres, relative to the origin of the costmap. twist: the present (v, w). accelerations:
    linear and angular. slowing: next to obstacles, and next to people, as fractions. weights: path, goal, heading,
    obstacle, change, people. footprint: corners (n, 2), m. people: states (n, 7), in cells. contact: of bodies, m.
    A twist is admissible if the robot can stop, after one more period, before a collision; if it stands within the
    inscribed radius of an obstacle, or an edge of it in one, if it leaves that zone without a lethal cell. Of the
    ways out, those with the most clearance are preferred, because the costs within the zone are all equal.
    """
    x, y, scores = pose[0] / resolution, pose[1] / resolution, np.full(twists.shape[0], math.inf)
    in_inscribed = cost_at(cells, x, y) >= INSCRIBED
    limit, corners = LETHAL if in_inscribed else INSCRIBED, footprint / resolution
    distances = contact / resolution, PROXIMITY / resolution
    touched = lethal_on_edges(cells, x, y, pose[2], corners)
    reach = lethal_distance(cells, x, y, MAX_REACH) if in_inscribed else 0.0
    approach = np.full(twists.shape[0], math.inf)
    for i in range(twists.shape[0]):
        v, w = twists[i]
        # duration of the ramp from the present twist to the sampled one
        ramp = max(abs(v - twist[0]) / accelerations[0], abs(w - twist[1]) / accelerations[1])
        braking_distance = _braking_distance(v, twist[0], ramp, period, accelerations[0]) / resolution + 1.0
        # forward simulation up to the end of the window, the goal or a collision
        end = roll_out(
            cells, x, y, pose[2], (twist[0] / resolution, twist[1]), (v / resolution, w), ramp, sim_time,
            remaining / resolution, limit, corners, touched, reach, people, distances,
        )  # fmt: skip
        # admissible velocities: those that stop before the obstacle
        if end.blocked and (end.distance < braking_distance or v < MIN_FORWARD_SPEED):
            continue
        # from within the inscribed zone, or with an edge of the footprint in an obstacle: those that leave it
        if v > MIN_FORWARD_SPEED and not _leaves(cells, end, in_inscribed, touched, corners):
            continue
        safe_speed = _safe_speed(end, max_speed, slowing)
        scores[i] = _score(path, resolution, end, (v, w), twist[1], sim_time, safe_speed, weights)
        if in_inscribed and v > MIN_FORWARD_SPEED:
            approach[i] = (reach - end.clearance) * resolution
    _prefer_clearance(scores, approach)
    return scores

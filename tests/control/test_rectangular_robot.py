"""A rectangular robot in closed loop: narrow doors, corners, rotations; judged by its exact polygon with shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from chefbot.behavior.behavior import BehaviorProgress, free_ahead
from chefbot.behavior.motions import Spin
from chefbot.control.controller import ControllerStatus
from chefbot.control.dwa import DwaController
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.planner import PlanningError
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter

ROBOT = load_robot("jackal")
FOOTPRINT = ROBOT.footprint
LIMITS = Limits.of(ROBOT)
CELL, PERIOD, SIDE = 0.05, 0.1, 120


def room() -> NDArray[np.int8]:
    """6 x 6 m with walls around it."""
    cells = np.zeros((SIDE, SIDE), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return cells


def with_door(width: int) -> NDArray[np.int8]:
    """A wall across the room at x = 3 m, 10 cm thick, with a doorway of so many cells from y = 3 m on."""
    cells = room()
    cells[:, 60:62] = 100
    cells[60 : 60 + width, 60:62] = 0
    return cells


def costs_of(cells: NDArray[np.int8]) -> Costmap:
    costs = LayeredCostmap(CostmapParams(), FOOTPRINT)
    costs.set_static(Grid(cells, CELL, 0.0, 0.0))
    return costs.update()


def gap(cells: NDArray[np.int8], driven: list[SE2]) -> float:
    """Return the smallest distance between the polygon on its path and the occupied squares, m; 0 if they meet."""
    near = [(row, column) for row, column in np.argwhere(cells >= 65)]
    walls = unary_union([box(c * CELL, r * CELL, (c + 1) * CELL, (r + 1) * CELL) for r, c in near])
    return min(Polygon(pose.apply(FOOTPRINT.polygon())).distance(walls) for pose in driven)


def drive(cells: NDArray[np.int8], start: SE2, goal: SE2) -> tuple[ControllerStatus, list[SE2]]:
    costmap = costs_of(cells)
    dwa, limiter, pose, now = DwaController(LIMITS), VelocityLimiter(LIMITS), start, (0.0, 0.0)
    dwa.set_path(GridPlanner().plan(costmap, start, goal))
    driven = [start]
    for _ in range(600):
        v, w, status = dwa.command(pose, now, costmap)
        if status is ControllerStatus.REACHED and now == (0.0, 0.0):
            break
        now = limiter.step(v, w, 0.0, PERIOD)
        for _ in range(5):
            turn = SE2(0.0, 0.0, now[1] * PERIOD / 10)
            pose = pose @ turn @ SE2(now[0] * PERIOD / 5, 0.0, 0.0) @ turn
            driven.append(pose)
    return status, driven


@pytest.mark.rotated
@pytest.mark.parametrize("width", [11, 12, 14, 18])
@pytest.mark.slow
def test_it_passes_a_doorway_that_its_disc_would_not(width: int) -> None:
    """From 55 cm on: its width of 43 cm and 12 cm; the disc around it needs 67 cm and more."""
    cells, goal = with_door(width), SE2(4.6, 4.4, 1.0)
    status, driven = drive(cells, SE2(1.2, 1.5, 0.5), goal)
    assert status is ControllerStatus.REACHED
    assert driven[-1].distance(goal) < 0.15
    assert gap(cells, driven) > 0.0


def test_its_circumscribed_disc_does_not_pass_there() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(ROBOT.circumscribed_radius))
    costs.set_static(Grid(with_door(12), CELL, 0.0, 0.0))
    with pytest.raises(PlanningError):
        GridPlanner().plan(costs.update(), SE2(1.2, 1.5, 0.5), SE2(4.6, 4.4, 1.0))


def test_no_path_leads_through_a_gap_below_its_width() -> None:
    with pytest.raises(PlanningError):
        GridPlanner().plan(costs_of(with_door(8)), SE2(1.2, 1.5, 0.5), SE2(4.6, 4.4, 1.0))


def test_no_pose_of_a_path_collides() -> None:
    cells = room()
    cells[40:43, :80] = cells[70:73, 30:] = 100
    costmap = costs_of(cells)
    path = GridPlanner().plan(costmap, SE2(1.0, 1.0, 0.0), SE2(5.0, 5.0, 0.0))
    assert all(costmap.lethal_on_footprint(SE2.of(pose)) == 0 for pose in path)


def corridor(width: int) -> Costmap:
    """A corridor of so many cells along x, whose middle is at y = 3 m."""
    cells = room()
    cells[: 60 - width // 2] = cells[60 + (width + 1) // 2 :] = 100
    return costs_of(cells)


def test_it_rotates_only_where_its_corners_are_free() -> None:
    pose = SE2(3.0, 3.0, 0.0)
    for width, free in ((12, False), (18, True)):
        dwa, costmap = DwaController(LIMITS), corridor(width)
        dwa.set_path(np.array([[3.0, 3.0, 0.0], [3.02, 3.0, 1.5]]))
        command = dwa.command(pose, (0.0, 0.0), costmap)
        assert (command.status is ControllerStatus.BLOCKED) is not free
        assert (abs(command.w) > 0.0) is free
        headings = (SE2(3.0, 3.0, yaw) for yaw in np.arange(0.0, 1.5, 0.1))
        steps = {Spin(1.5, 1.0, 2.0).update(heading, costmap, PERIOD).progress for heading in headings}
        assert steps == ({BehaviorProgress.RUNNING} if free else {*steps, BehaviorProgress.BLOCKED})


def test_a_post_beside_a_corner_blocks_the_turn_towards_it() -> None:
    cells = room()
    cells[54, 63] = 100
    pose, costmap = SE2(3.0, 3.0, 0.0), costs_of(cells)
    assert costmap.lethal_on_footprint(pose) == 0
    for yaw, free in ((-0.6, False), (0.6, True)):
        dwa = DwaController(LIMITS)
        dwa.set_path(np.array([[3.0, 3.0, 0.0], [3.02, 3.0, yaw]]))
        command = dwa.command(pose, (0.0, 0.0), costmap)
        assert command.status is (ControllerStatus.RUNNING if free else ControllerStatus.BLOCKED)


def test_backing_up_ends_before_the_rear_corners_touch() -> None:
    cells = room()
    cells[52:54, 40] = 100  # a post behind the right rear corner
    costmap, pose = costs_of(cells), SE2(3.0, 2.85, 0.0)
    assert free_ahead(costmap, pose, -0.5)
    assert not free_ahead(costmap, pose, -0.9)


def test_marks_under_the_body_are_cleared_and_no_others() -> None:
    costs = LayeredCostmap(CostmapParams(track_unknown=False, inflation_radius=0.0), FOOTPRINT, rolling=True)
    front, beside = np.array([0.0]), np.array([math.pi / 2])
    costs.mark_and_clear("scan", SE2(0.0, 0.0, 0.0), front, np.array([0.18]))
    costs.mark_and_clear("other", SE2(0.0, 0.0, 0.0), beside, np.array([0.26]))
    costs.clear_footprint(SE2(0.0, 0.0, 0.0))
    cells = costs.update()
    assert cells.at(0.18, 0.01) != LETHAL
    assert cells.at(0.01, 0.26) == LETHAL

"""The floor that a robot can observe: all that is in sight of where it can get, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.buildings.world_file import NamedPose, Wall, WorldSpec
from chefbot.demo.summary import ground_truth_map, map_quality
from chefbot.maths.grid import Grid
from chefbot.robot.load import load_robot
from chefbot.sim.world.observable_floor import observable_floor
from chefbot.sim.world.world import World, build_world

ROBOT = load_robot("chefbot_lidar")


def two_rooms(gap: float, yaw: float = 0.0) -> World:
    """Return rooms of 4 m by 4 m side by side, whose wall at x = 2 ends this far from that at y = 2."""
    outside = [([-2.0, -2.0], [6.0, -2.0]), ([-2.0, 2.0], [6.0, 2.0])]
    sides = [([-2.0, -2.0], [-2.0, 2.0]), ([6.0, -2.0], [6.0, 2.0]), ([2.0, -2.0], [2.0, 2.0 - gap])]
    walls = [Wall(start=start, end=end) for start, end in (*outside, *sides)]
    spec = WorldSpec(name="rooms", walls=walls, places={"home": NamedPose(x=-0.5, y=-0.5, yaw=yaw)})
    return build_world(spec, "rooms")


def observed(world: World) -> tuple[Grid, np.ndarray]:
    plan = ground_truth_map(world, ROBOT)
    return plan, observable_floor(world, ROBOT, plan)


@pytest.mark.parametrize("yaw", [0.0, 1.0])
def test_a_room_with_a_passage_is_observable(yaw: float) -> None:
    plan, mask = observed(two_rooms(0.8, yaw))
    assert mask.sum() == pytest.approx((plan.cells == 0).sum(), rel=0.01)


def test_a_room_behind_a_narrow_gap_is_seen_through_the_gap_only() -> None:
    world = two_rooms(0.3)
    plan, mask = observed(world)
    behind = plan.origin_x + (np.arange(plan.width) + 0.5) * plan.resolution > 2.5  # start at x = -0.5
    free = plan.cells == 0
    assert mask[:, ~behind].sum() == pytest.approx(free[:, ~behind].sum(), rel=0.05)
    assert mask[:, behind].sum() < 0.3 * free[:, behind].sum()
    # a map of the room in front of it is complete
    near = Grid(
        np.where(behind[None, :] & ~mask, np.int8(-1), plan.cells),
        plan.resolution,
        plan.origin_x,
        plan.origin_y,
    )
    assert map_quality(near, world, ROBOT).explored == 1.0


def test_nothing_is_seen_through_walls() -> None:
    plan, mask = observed(two_rooms(0.0))
    rows, columns = np.nonzero(mask)
    x = plan.origin_x + (columns + 0.5) * plan.resolution
    assert x.max() < 2.5 and len(rows) > 0

"""Bearings of a lidar's beams: a closed full turn, or a part of it with a beam at each end."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import LASER
from chefbot.design.checks.sensor_occlusion import hidden_sectors
from chefbot.exploration.session import field_of_view
from chefbot.maths.costs import LETHAL
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.std_msgs import Float64
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import Lidar
from chefbot.sim.rays import lidar_angles

ROBOT = load_robot("chefbot_lidar")


def lidar(**values: float) -> Lidar:
    assert ROBOT.sensors.lidar is not None
    return msgspec.structs.replace(ROBOT.sensors.lidar, **values)


def test_a_full_turn_ends_one_step_before_its_start() -> None:
    angles = lidar_angles(lidar())
    assert angles[0] == -math.pi
    assert np.allclose(np.diff(angles), 2.0 * math.pi / 360, atol=1e-12)
    assert angles[-1] == pytest.approx(math.pi - 2.0 * math.pi / 360)


@given(st.floats(0.1, 6.2), st.integers(3, 2000))
def test_a_part_of_a_turn_has_a_beam_at_each_end(angle: float, beams: int) -> None:
    one = lidar(field_of_view=angle, beams=beams)
    angles = lidar_angles(one)
    assert len(angles) == beams
    assert (angles[0], angles[-1]) == pytest.approx((-angle / 2, angle / 2))
    assert (one.angle_min, one.angle_max) == pytest.approx((angles[0], angles[-1]))


def test_tubes_behind_the_field_of_view_hide_nothing() -> None:
    assert hidden_sectors(ROBOT, lidar()).angle > 0.4
    half = hidden_sectors(ROBOT, lidar(field_of_view=math.pi))
    assert 0.0 < half.angle == pytest.approx(hidden_sectors(ROBOT, lidar()).angle / 2)
    assert hidden_sectors(ROBOT, lidar(field_of_view=1.0)) == (0.0, {}, 0.0)


def test_the_explorer_gets_the_field_of_view() -> None:
    sensors = msgspec.structs.replace(ROBOT.sensors, lidar=lidar(field_of_view=4.0))
    assert field_of_view(ROBOT) == 2.0 * math.pi
    assert field_of_view(msgspec.structs.replace(ROBOT, sensors=sensors)) == 4.0


def test_only_a_full_turn_covers_the_rear() -> None:
    for angle, rear, ahead_only in ((6.3, True, False), (4.7, False, False), (3.0, False, True)):
        sensors = msgspec.structs.replace(ROBOT.sensors, lidar=lidar(field_of_view=min(angle, 2.0 * math.pi)))
        assert (sensors.covers_rear, sensors.forward_sensing_only) == (rear, ahead_only)
    assert not load_robot("chefbot").sensors.covers_rear


@pytest.mark.parametrize(("name", "kept"), [("chefbot_lidar", False), ("jackal", True)])
def test_marks_that_a_lidar_does_not_see_again_are_kept(name: str, kept: bool) -> None:
    """The recovery behavior that clears marks is followed by one that backs up."""
    node = NodeWithMark(name)
    node.on_clear_costmaps(Float64(2.0))
    assert (node.costs.update().at(-0.5, 0.0) == LETHAL) is kept


class NodeWithMark(LocalCostmapNode):
    """A local costmap with an obstacle behind the robot, without a loop."""

    def __init__(self, name: str) -> None:
        self.robot = load_robot(name)
        params = CostmapParams(track_unknown=False)
        self.costs = self._costs = LayeredCostmap(params, self.robot.footprint, rolling=True)
        self.costs.mark_and_clear(LASER, IDENTITY, np.array([math.pi]), np.array([0.5]))

    def _pose(self) -> SE2:
        return IDENTITY

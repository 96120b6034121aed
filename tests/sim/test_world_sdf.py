"""Tests that a world exported for Gazebo contains every solid at its pose and the robot at its start pose."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from tests.design.sdf_checker import read_by_libsdformat

from chefbot.robot.load import load_robot
from chefbot.sim.world.shapes import BOX, CAPSULE
from chefbot.sim.world.world import World, built_in_worlds, load_world
from chefbot.sim.world.world_sdf import PREFIX, world_sdf


@pytest.fixture(params=sorted(built_in_worlds()))
def world(request: pytest.FixtureRequest) -> World:
    return load_world(request.param)


@pytest.mark.rotated("exported packages and worlds")
@pytest.mark.slow
def test_libsdformat_reads_every_solid(world: World, tmp_path: Path) -> None:
    robot, file = load_robot("chefbot"), tmp_path / "world.sdf"
    file.write_text(world_sdf(robot, world))
    models = read_by_libsdformat(file)
    assert robot.name in models
    objects = {name: model for name, model in models.items() if name != robot.name}
    assert all(model["static"] for model in objects.values())
    assert (
        sum(len(model["collisions"]) for model in objects.values()) == len(world.shapes_at_rest()) + 1
    )  # the floor


def test_positions_and_sizes_equal_those_of_the_world(world: World) -> None:
    element = ET.fromstring(world_sdf(load_robot("chefbot"), world)).find("world")
    assert element is not None
    for shape in world.shapes_at_rest():
        name, _, part = shape.name.partition("/")
        solid = element.find(f"model[@name='{PREFIX}{name}']/link/collision[@name='{part or 'all'}']")
        assert solid is not None, shape.name
        x, y, z, roll, pitch, yaw = (float(word) for word in (solid.findtext("pose") or "").split())
        assert (x, y, z, roll, pitch) == pytest.approx((shape.x, shape.y, shape.z, 0.0, 0.0), abs=1e-7)
        assert math.remainder(yaw - shape.yaw, math.tau) == pytest.approx(0.0, abs=1e-7)
        if shape.kind == BOX:
            size = [float(word) for word in (solid.findtext("geometry/box/size") or "").split()]
            assert size == pytest.approx([2 * half for half in shape.half], rel=1e-7)
        else:
            tag = "capsule" if shape.kind == CAPSULE else "cylinder"
            assert float(solid.findtext(f"geometry/{tag}/radius") or 0) == pytest.approx(shape.half[0])
            assert float(solid.findtext(f"geometry/{tag}/length") or 0) == pytest.approx(2 * shape.half[2])


def test_the_robot_is_at_its_start_pose() -> None:
    world, robot = load_world("hotel"), load_robot("chefbot_lidar")
    model = ET.fromstring(world_sdf(robot, world)).find(f"world/model[@name='{robot.name}']")
    assert model is not None
    x, y, z, _, _, yaw = (float(word) for word in (model.findtext("pose") or "").split())
    assert (x, y, z, yaw) == pytest.approx((world.start.x, world.start.y, 0.0, world.start.yaw))

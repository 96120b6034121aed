"""Tests the devices that publish the places and the start pose of a world."""

from __future__ import annotations

from typing import Any

import pytest

from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Context
from chefbot.runtime.transform_buffer import TransformBuffer
from chefbot.sim.world.load import load_world
from chefbot.sim.world.places import WorldPlacesDevice, WorldPlacesParams
from chefbot.sim.world.saved_map import StartPoseDevice, StartPoseParams

ROBOT = load_robot("chefbot_lidar")


def context() -> Context:
    return Context("places", Loop(StepClock()), ROBOT, TransformBuffer())


def test_places_are_published_relative_to_the_start() -> None:
    device_context, found = context(), list[Any]()
    WorldPlacesDevice(device_context, WorldPlacesParams(world="hotel")).start()
    device_context.loop.subscribe("places", "test", found.append)
    device_context.loop.run(until_ns=1_000_000)
    world = load_world("hotel")
    (places,) = found
    assert {place.name for place in places.places} == set(world.places)
    for place in places.places:
        expected = world.start.between(world.places[place.name])
        assert place.pose.pose.se2 == pytest.approx(expected, abs=1e-6)
        assert place.pose.header.frame_id == "map"


def test_an_unknown_world_aborts_the_start() -> None:
    with pytest.raises(UserError, match="hotle"):
        WorldPlacesDevice(context(), WorldPlacesParams(world="hotle")).start()


def test_the_initial_pose_is_given_or_the_origin_of_the_map() -> None:
    given = StartPoseParams(world="hotel", x=1.0, y=2.0, yaw=0.5)
    assert StartPoseDevice(context(), given).pose() == (1.0, 2.0, 0.5)
    assert StartPoseDevice(context(), StartPoseParams(world="hotel")).pose() == (0.0, 0.0, 0.0)

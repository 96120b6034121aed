"""The simulated colour camera: its picture, its intrinsics, and tags that hang on walls."""

from __future__ import annotations

from typing import get_args

import msgspec
import numpy as np
import pytest
from tests.support.tag_pictures import camera_robot

from chefbot.buildings.world_file import NamedPose, Wall, WallTag, WorldSpec
from chefbot.errors import UserError
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import TAG_COUNTS, Lens, TagFamily
from chefbot.sim.cameras.color_camera import SimulatedColorCamera
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import World, build_world
from chefbot.tags.detector import TagDetector
from chefbot.tags.family import patterns_of


def room(*tags: WallTag) -> World:
    """Return a wall 2 m ahead of the robot with tags on it."""
    spec = WorldSpec(
        name="room",
        walls=[Wall(start=[x, -3.0], end=[x, 3.0]) for x in (2.06, -2.0)],
        tags=list(tags),
        places={"home": NamedPose(x=0.0, y=0.0)},
    )
    return build_world(spec, "room")


def picture_of(world: World) -> np.ndarray:
    robot = camera_robot()
    camera = robot.sensors.color_camera
    assert camera is not None
    simulated = SimulatedColorCamera(camera, Simulation(robot, world))
    simulated.start()
    picture = simulated.result()
    simulated.close()
    return picture


def tag(yaw: float = np.pi, x: float = 2.0) -> WallTag:
    return WallTag(id=3, size=0.3, x=x, y=0.0, z=0.22, yaw=yaw)


def test_only_the_board_differs_from_the_bare_wall() -> None:
    bare, tagged = picture_of(room()), picture_of(room(tag()))
    changed = np.argwhere((bare != tagged).any(axis=2))
    (top, left), (bottom, right) = changed.min(axis=0), changed.max(axis=0)
    side = 503.6 * tag().board_size / 1.88  # focal length times size by distance
    assert bottom - top + 1 == pytest.approx(side, abs=2.0) == right - left + 1
    assert (top + bottom) / 2 == pytest.approx(239.5 - 503.6 * (0.22 - 0.16) / 1.88, abs=1.0)
    board = tagged[top + 2 : bottom - 1, left + 2 : right - 1]
    assert board.min() < 40 and board.max() > 200


def test_a_tag_is_not_seen_from_behind() -> None:
    turned = picture_of(room(tag(yaw=0.0, x=1.0)))
    assert turned[200:280, 280:360].min() > 100  # its white back


def test_pictures_are_those_of_an_ideal_lens() -> None:
    robot = camera_robot(lens=Lens(fx=9.0, fy=9.0, cx=5.0, cy=5.0))
    camera = robot.sensors.color_camera
    assert camera is not None
    simulated = SimulatedColorCamera(camera, Simulation(robot, room()))
    info = simulated.camera_info(Header())
    assert info.k[0] == pytest.approx(camera.focal_length_px) and not info.d.any()
    simulated.close()


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [
        ({"family": "tag16h5", "id": 30}, r"tags\[1\].id: family tag16h5 has the tags 0 to 29, not 30"),
        ({"z": 0.1}, r"tags\[1\].z: its lower edge is below the floor"),
    ],
)
def test_an_impossible_tag_is_named(bad: dict[str, object], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        room(tag(), msgspec.structs.replace(tag(), **bad))


def test_the_same_tag_may_hang_twice() -> None:
    twice = picture_of(room(tag(), msgspec.structs.replace(tag(), y=0.6)))
    assert [found.id for found in TagDetector("tag36h11").detect(twice)] == [3, 3]


@pytest.mark.parametrize("family", get_args(TagFamily))
def test_the_number_of_tags_is_that_of_opencv(family: TagFamily) -> None:
    assert len(patterns_of(family).squares) == TAG_COUNTS[family]


def test_a_tag_beside_the_camera_is_drawn_as_far_as_it_is_seen() -> None:
    beside = tag(yaw=-np.pi / 2.0, x=0.4)  # it reaches from before the camera to behind it
    picture = picture_of(room(msgspec.structs.replace(beside, y=0.4, size=1.5, z=1.1)))
    assert picture[:, 600:].min() < 40 or picture[:, :40].min() < 40


def test_a_robot_without_the_camera_has_no_view() -> None:
    with pytest.raises(UserError, match="robot chefbot has no colour camera"):
        Simulation(load_robot("chefbot"), room()).color_capture()

"""Every launch file that comes with the package: it parses, it runs, and it runs the same way again.

New launch files are tested as soon as they are there.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import pytest
from tests.support.fake_robot import fake_robot

from chefbot.errors import UserError
from chefbot.launcher.launch import run_launch
from chefbot.launcher.session import session, start
from chefbot.msgs.geometry_msgs import Twist
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import built_in_launches, load_launch, node_class, node_params
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.replay import Replay
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

NEEDS_A_ROBOT = {
    *("keyboard_teleop", "gamepad_teleop", "view_robot", "view_navigation"),
    *("remote_page", "remote_teleop", "remote_gamepad"),
}
NEEDS_A_BOARD = {"robot_standalone"}  # tests/devices/test_board.py has one
SENSES_NOTHING = {"model_robot"}
PARTS = {name for name in built_in_launches() if not load_launch(name).description}
ALONE = sorted(set(built_in_launches()) - NEEDS_A_ROBOT - NEEDS_A_BOARD - PARTS)
CHAPTER = {
    *("chefbot_empty_world", "chefbot_hotel_world", "gmapping_demo", "amcl_demo", "view_navigation"),
    *("view_robot", "model_robot", "3dsensor", "keyboard_teleop", "robot_standalone"),
}
SECOND = 1_000_000_000
SEED, SECONDS, NUDGES = 11, 3, 12
SLOW_NUDGES = 4
"""Nudges in addition for a robot that creeps at first, where no sensor has looked yet."""
DRIVING = Twist.of(0.2, 0.4)


class PublicationDigest(NamedTuple):
    """One publication, small enough to keep."""

    topic: str
    publisher: str
    time_ns: int
    digest: bytes


@pytest.fixture(scope="module")
def saved_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room as a mapper would save it, with its places beside it."""
    path = tmp_path_factory.mktemp("map") / "room.yaml"
    world = load_any_world("room", load_robot("chefbot_lidar"))
    save_map(path, floor_plan(world, load_robot("chefbot_lidar").sensors.lidar.mount.z))
    save_places(places_path(path), world.places)
    return path


def given(name: str, saved_map: Path) -> dict[str, str]:
    """Arguments with which the launch runs fast and without a screen."""
    wanted = {"headless": "true", "seed": str(SEED), "map_file": str(saved_map), "pictures": "1"}
    known = load_launch(name).args
    if known.get("world", "empty") != "empty":
        wanted |= {"world": "room", "people": "1"}
    return {key: value for key, value in wanted.items() if key in known}


def run(name: str, arguments: dict[str, str], record: Path | None = None) -> list[PublicationDigest]:
    """All that was published in some seconds, while somebody drives now and then."""
    launch = load_launch(name, arguments)
    publications: list[PublicationDigest] = []

    def observe(one: Publication) -> None:
        digest = hashlib.sha256(one.message.to_cdr()).digest()
        publications.append(PublicationDigest(one.topic, one.publisher, one.time_ns, digest))

    robot = load_robot(str(launch.args["robot"]))
    with session(robot, int(launch.args["seed"]), launch.clock, 0.0, record) as system:
        system.loop.add_observer(observe)
        start(system, launch)
        for _ in range(NUDGES):
            nudge(system)
            system.loop.run(until_ns=system.loop.now_ns + SECONDS * SECOND // NUDGES)
    return publications


def nudge(system: NodeContainer) -> None:
    system.loop.post(lambda: system.loop.publish("cmd_vel_teleop", DRIVING, "person", from_device=True))


def test_the_chapter_launches_exist() -> None:
    assert set(built_in_launches()) >= CHAPTER
    assert not CHAPTER & PARTS, "each states what it is about"
    page = (Path(__file__).parents[2] / "docs" / "chapter.md").read_text()
    assert [name for name in sorted(CHAPTER) if f"chefbot launch {name}" not in page] == []


@pytest.mark.parametrize("name", sorted(built_in_launches()))
def test_launch_params_are_valid(name: str) -> None:
    launch = load_launch(name)
    for node, entry in launch.nodes.items():
        node_params(node_class(entry.kind, node), entry.params, node)
    assert launch.nodes
    assert launch == load_launch(name + ".launch") == load_launch(name + ".launch.xml")


@pytest.mark.rotated
@pytest.mark.parametrize(
    ("name", "robot"), [*((name, "chefbot") for name in ALONE), ("gmapping_demo", "chefbot_lidar")]
)
@pytest.mark.slow
def test_the_run_is_repeatable_and_its_replay_is_identical(
    name: str, robot: str, saved_map: Path, tmp_path: Path
) -> None:
    arguments = {**given(name, saved_map), "robot": robot}
    first = run(name, arguments, tmp_path / "run.mcap")
    again = run(name, arguments)
    difference = next((pair for pair in zip(first, again, strict=False) if pair[0] != pair[1]), None)
    assert difference is None
    assert len(first) == len(again)
    assert all(count > 1 for topic, count in Counter(one.topic for one in first).items() if topic == "tf")
    senses = set() if name in SENSES_NOTHING else {"imu/data", "wheel_ticks"}
    assert senses | {"tf"} <= {one.topic for one in first}
    replay = Replay(read_log(tmp_path / "run.mcap"))
    replay.run()
    assert replay.differences == []
    assert replay.compared > 5 * SECONDS


def test_another_seed_is_another_run(saved_map: Path) -> None:
    arguments = given("chefbot_hotel_world", saved_map)
    one, other = (run("chefbot_hotel_world", {**arguments, "seed": seed}) for seed in ("1", "2"))
    assert one != other


@pytest.mark.parametrize("name", ["chefbot_hotel_world", "gmapping_demo", "amcl_demo"])
def test_an_operator_can_drive_the_robot(name: str, saved_map: Path) -> None:
    launch = load_launch(name, given(name, saved_map))
    with session(load_robot("chefbot"), SEED, launch.clock, 0.0, None) as system:
        start(system, launch)
        for _ in range(NUDGES + SLOW_NUDGES):
            nudge(system)
            system.loop.run(until_ns=system.loop.now_ns + SECONDS * SECOND // NUDGES)
        pose = system.transforms.lookup("map", "base_link")
    assert pose.x > 0.2
    assert 0.2 < pose.yaw < 1.5


def test_the_depth_camera_alone_builds_a_map(saved_map: Path) -> None:
    launch = load_launch("3dsensor", given("3dsensor", saved_map))
    topics: set[str] = set()
    with session(load_robot("chefbot"), SEED, launch.clock, 0.0, None) as system:
        system.loop.add_observer(lambda one: topics.add(one.topic))
        start(system, launch)
        system.loop.run(until_ns=2 * SECOND)
        system.transforms.lookup("map", "camera_depth_frame")
    assert {"camera/depth/image_raw", "camera/color/image_raw", "scan", "obstacles"} <= topics
    assert "odom" not in topics


@pytest.mark.parametrize("name", ["view_robot", "view_navigation"])
def test_views_need_a_running_robot(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        page = f"page:={robot.url}"
        run_launch(name, ["headless:=true", "duration:=5", "speed:=0", page])
    assert "A robot runs at" in capsys.readouterr().out
    with pytest.raises(UserError, match="no robot runs at"):
        run_launch(name, ["headless:=true", page])


def test_views_open_the_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    with fake_robot() as robot:
        run_launch("view_navigation", [f"page:={robot.url}"])
        assert opened == [robot.url]


def test_the_built_robot_without_its_board_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"port .* does not exist.*board_port:=auto"):
        run_launch("robot_standalone", ["headless:=true", "duration:=5", f"board_port:={tmp_path}/board"])

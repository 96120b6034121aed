"""`world:=MAP.yaml`: a launch that localizes takes the same map, and knows its start and its places."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chefbot.launcher.session import session, start
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Places
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import Odometry
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.world import load_world
from chefbot.storage.map_files import save_map

ROBOT = load_robot("chefbot_lidar")
SECOND = 1_000_000_000
TURN = Twist.of(0.1, 0.6)


@pytest.fixture(scope="module")
def room_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room as a perfect mapper's map, without places."""
    return save_map(
        tmp_path_factory.mktemp("map") / "stranger",
        floor_plan(load_world("room"), ROBOT.sensors.lidar.mount.z),
    )


@pytest.mark.rotated
@pytest.mark.slow
@pytest.mark.parametrize("given", [{}, {"start": "[0.4, 0.3, 2.0]"}], ids=["most room", "start"])
def test_localization_and_ground_truth_share_the_map_frame(given: dict[str, str], room_map: Path) -> None:
    arguments = {"world": str(room_map), "headless": "true", "robot": ROBOT.name, "seed": "5", **given}
    launch = load_launch("amcl_demo", arguments)
    truth: list[SE2] = []
    places: list[Places] = []

    def observe(one: Publication) -> None:
        if isinstance(one.message, Odometry) and one.topic == "ground_truth":
            truth.append(one.message.pose.pose.se2)
        elif isinstance(one.message, Places):
            places.append(one.message)

    with session(ROBOT, 5, launch.clock, 0.0, None) as system:
        system.loop.add_observer(observe)
        start(system, launch)
        for _ in range(12):
            system.loop.post(lambda: system.loop.publish("cmd_vel_teleop", TURN, "person", from_device=True))
            system.loop.run(until_ns=system.loop.now_ns + SECOND // 4)
        found = system.transforms.lookup("map", "base_link")
    if given:
        assert (truth[0].x, truth[0].y, truth[0].yaw) == pytest.approx((0.4, 0.3, 2.0), abs=0.01)
    error = truth[-1].between(found)
    assert math.hypot(error.x, error.y) < 0.2
    assert abs(error.yaw) < 0.2
    assert {"home", "kitchen", "table_1"} <= {place.name for place in places[-1].places}

"""A robot that drives over an edge which its sensors cannot see lies still, and drives again once it is released."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.std_msgs import Bool, String
from chefbot.safety.stop_latch import TIPPED_OVER
from tests.chaos.drop_off_drive import STEP, Approach, world_with_edge
from tests.chaos.sensor_fault_drive import ROBOTS, SensorFaultDrive

EDGE = Approach(depth=STEP, distance=1.2, yaw=0.0, speed=1.0, by_path=True)  # stairs
UPRIGHT = SE2(-4.0, -2.0, 2.0)


@pytest.mark.slow
def test_a_fallen_robot_lies_still_until_it_is_released(tmp_path: Path) -> None:
    drive = SensorFaultDrive(ROBOTS["lidar"], None, str(world_with_edge(EDGE, tmp_path)), seed=3)
    notices: list[str] = []
    wheels: list[float] = []

    def keep_notice(text: String) -> None:
        notices.append(text.data)

    def keep_wheels(speeds: WheelSpeeds) -> None:
        wheels.append(max(abs(speeds.left), abs(speeds.right)))

    drive.loop.subscribe("base/notice", "test", keep_notice)
    drive.loop.subscribe("wheel_speeds", "test", keep_wheels)
    drive.follow_straight_path(2.5)
    while drive.simulation.tilt < math.radians(60.0) and drive.loop.now_ns < 60e9:
        drive.run(0.1)
    drive.run(1.0)
    assert TIPPED_OVER in notices and max(wheels) > 1.0
    # Lying, and set upright at another place, it does not turn its wheels
    wheels.clear()
    drive.run(3.0)
    drive.simulation.kidnap(UPRIGHT)
    drive.run(4.0)
    assert max(wheels) == 0.0 and drive.simulation.tilt < math.radians(2.0)
    # Released, it follows a path as before
    drive.loop.publish("stop_request", Bool(False), "test")
    drive.run(0.1)
    drive.follow_straight_path(1.0)
    drive.run(16.0)
    driven = UPRIGHT.between(drive.simulation.truth().pose)
    assert driven.x == pytest.approx(1.0, abs=0.15) and abs(driven.y) < 0.15
    drive.system.stop()

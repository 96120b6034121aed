"""Processes are killed while the robot drives: it stops, they come back, driving goes on."""

from __future__ import annotations

import time

import pytest

from chefbot.msgs.action_msgs import STATUS_ABORTED
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.nav2_msgs import Spin, Spin_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from tests.chaos.launched import launched, tell, wait_for
from tests.support.processes import children_of, is_alive
from tests.support.waiting import PATIENCE, in_time

STOP_NS = 200_000_000
"""Simulated, which is the wall's time here; the supervisor looks every 50 ms and the base commands every 50 ms."""


@pytest.mark.slow
@pytest.mark.timed
def test_robot_stops_when_the_controller_dies_and_resumes_later() -> None:
    with launched("parts.yaml", "headless:=true") as (one, node):
        speeds: list[WheelSpeeds] = []
        maps: list[OccupancyGrid] = []
        node.subscription("/wheel_speeds", WheelSpeeds, speeds.append)
        node.subscription("/map", OccupancyGrid, maps.append, TRANSIENT_LOCAL_QOS)
        spin = ActionClient(node, "/spin", Spin)
        wait_for(lambda: spin.served and maps)

        def drives() -> bool:
            return bool(speeds) and abs(speeds[-1].left) > 1.0

        going = spin.send_goal_async(Spin_Goal(30.0, Duration.of(60.0)))
        wait_for(drives)
        killed_ns, killed = speeds[-1].header.stamp.ns, time.monotonic()
        one.kill("control")
        wait_for(lambda: speeds[-1].left == 0.0 and speeds[-1].right == 0.0)
        stood_ns = next(
            said.header.stamp.ns for said in speeds if said.header.stamp.ns > killed_ns and said.left == 0.0
        )
        tell(f"stood {(stood_ns - killed_ns) / 1e6:.0f} ms of simulated time after the kill")
        assert in_time(stood_ns - killed_ns, STOP_NS)
        assert going.result.exception(PATIENCE) or going.result.result()[0] == STATUS_ABORTED
        wait_for(lambda: not spin.served or time.monotonic() - killed > 1.0)
        wait_for(lambda: spin.served)
        tell(f"control was back after {time.monotonic() - killed:.1f} s")

        killed_pid = one.kill("slam")
        wait_for(lambda: one.child("slam") not in (None, killed_pid))
        children = children_of(one.process.pid)
        wait_for(lambda: spin.served)
        spin.send_goal_async(Spin_Goal(30.0, Duration.of(60.0)))
        wait_for(drives)
        one.stop()
        assert not any(map(is_alive, children))

"""Tests that the robot stops when the controller's process is killed, and drives again after the restart."""

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
from tests.chaos.launch_process import report, run_launch_file, wait_for
from tests.support.processes import children_of, is_alive
from tests.support.waiting import PATIENCE, in_simulated_time

STOP_NS = 200_000_000
"""Simulated time at a real-time factor of 1; supervisor and base both work with a period of 50 ms."""


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_robot_stops_when_the_controller_dies_and_resumes_later() -> None:
    with run_launch_file("three_processes.yaml", "headless:=true") as (chefbot, node):
        speeds: list[WheelSpeeds] = []
        maps: list[OccupancyGrid] = []
        node.subscription("/wheel_speeds", WheelSpeeds, speeds.append)
        node.subscription("/map", OccupancyGrid, maps.append, TRANSIENT_LOCAL_QOS)
        spin = ActionClient(node, "/spin", Spin)
        wait_for(lambda: spin.served and maps)

        def drives() -> bool:
            return bool(speeds) and abs(speeds[-1].left) > 1.0

        spinning = spin.send_goal_async(Spin_Goal(30.0, Duration.of(60.0)))
        wait_for(drives)
        killed_ns, killed = speeds[-1].header.stamp.ns, time.monotonic()
        chefbot.inject("killed", "control")
        wait_for(lambda: speeds[-1].left == 0.0 and speeds[-1].right == 0.0)
        stamps = [(speed.header.stamp.ns, speed.left) for speed in speeds]
        stopped_ns = next(stamp for stamp, left in stamps if stamp > killed_ns and left == 0.0)
        report(f"stopped {(stopped_ns - killed_ns) / 1e6:.0f} ms of simulated time after the kill")
        assert in_simulated_time(stopped_ns - killed_ns, STOP_NS)
        assert spinning.result.exception(PATIENCE) or spinning.result.result()[0] == STATUS_ABORTED
        wait_for(lambda: not spin.served or time.monotonic() - killed > 1.0)
        wait_for(lambda: spin.served)
        report(f"the controller was up after {time.monotonic() - killed:.1f} s")

        killed_pid = chefbot.inject("killed", "slam")
        wait_for(lambda: chefbot.child("slam") not in (None, killed_pid))
        children = children_of(chefbot.process.pid)
        wait_for(lambda: spin.served)
        spin.send_goal_async(Spin_Goal(30.0, Duration.of(60.0)))
        wait_for(drives)
        chefbot.stop()
        assert not any(map(is_alive, children))

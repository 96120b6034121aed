"""Tests that the robot stops, recovers and delivers when one of its processes is killed during a delivery."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.demo.processes import PROCESSES
from chefbot.demo.summary import ground_truth_map
from chefbot.mapping.compare import quality
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.sim.world.load import load_any_world
from tests.chaos.delivery_launch import (
    ARRIVED_M,
    ROBOT,
    WORLD,
    DeliveryObserver,
    ProcessFault,
    demo_launch,
    localized_robot,
)
from tests.chaos.launch_process import report, run_chefbot, wait_for
from tests.support.waiting import in_simulated_time, in_time

STOP_MS, BACK_S, FAR_M = 200.0, 5.0, 0.8


def check_kill(observer: DeliveryObserver, process: str) -> None:
    """Kill a process and check that the robot stops, stands, and the process returns in time."""
    fault = ProcessFault(observer, process)
    took = fault.wait_until_back()
    report(f"{process}: stopped {fault.stopped_ms:.0f} ms after the kill, back after {took:.1f} s")
    assert in_simulated_time(fault.stopped_ms, STOP_MS) and in_time(took, BACK_S)


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_robot_stops_recovers_and_delivers_after_each_kill(tmp_path: Path) -> None:
    """One delivery, during which each process is killed once; every kill counts."""
    with localized_robot(tmp_path) as observer:
        observer.order("table_1")
        wait_for(lambda: observer.delivery_is("driving", "table_1"))
        for process in PROCESSES:
            check_kill(observer, process)
        loads = sum(status.state == "loading" for status in observer.deliveries)
        observer.await_arrival("table_1")
        assert observer.distance_to("table_1") < ARRIVED_M
        assert (
            sum(status.state == "loading" for status in observer.deliveries) == loads == 1
        )  # not loaded again
        output = observer.chefbot.stop()
        assert all(f"process {process} is ready again" in output for process in PROCESSES)
        assert observer.chefbot.process.returncode == 0


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_a_killed_mapper_resumes_with_its_map(tmp_path: Path) -> None:
    """A mapper without restored state would start a new map with another origin, in which home is elsewhere."""
    path, launch = demo_launch(tmp_path, "explore", headless="true")
    with run_chefbot("launch", str(path)) as (chefbot, node):
        observer, maps = DeliveryObserver(chefbot, node, launch), list[OccupancyGrid]()
        node.subscription("/map", OccupancyGrid, maps.append, TRANSIENT_LOCAL_QOS)
        wait_for(lambda: observer.travelled() > FAR_M)
        check_kill(observer, "slam")
        before = len(maps)
        wait_for(lambda: len(maps) >= before + 3)
        found = quality(
            maps[-1].grid, ground_truth_map(load_any_world(WORLD, load_robot(ROBOT)), load_robot(ROBOT))
        )
        report(f"{100 * found.precision:.1f} % of the map's walls exist")
        assert found.precision > 0.95

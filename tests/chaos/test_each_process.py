"""Each process of the demo's waiter is killed while it carries food: it stops, and the food arrives all the same."""

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
from tests.chaos.launched import running, tell, wait_for
from tests.chaos.waiter import ARRIVED_M, ROBOT, WORLD, Blow, Watched, demo_launch, waiting_robot
from tests.support.waiting import in_time

STOP_MS, BACK_S, FAR_M = 200.0, 5.0, 0.8


def struck(watched: Watched, process: str) -> None:
    """It stops, stands, and comes back."""
    blow = Blow(watched, process)
    took = blow.wait_until_back()
    tell(f"{process}: stopped {blow.stopped_ms:.0f} ms after the kill, back after {took:.1f} s")
    assert in_time(blow.stopped_ms, STOP_MS) and in_time(took, BACK_S)


@pytest.mark.slow
@pytest.mark.timed
@pytest.mark.parametrize("process", PROCESSES)
def test_robot_stops_recovers_and_delivers_after_each_kill(tmp_path: Path, process: str) -> None:
    with waiting_robot(tmp_path) as watched:
        watched.order("table_1")
        wait_for(lambda: watched.has("driving", "table_1"))
        struck(watched, process)
        loads = sum(said.state == "loading" for said in watched.deliveries)
        watched.await_arrival("table_1")
        assert watched.at("table_1") < ARRIVED_M
        assert sum(said.state == "loading" for said in watched.deliveries) == loads == 1  # it had the food
        said = watched.one.stop()
        assert f"process {process} is ready again" in said
        assert watched.one.process.returncode == 0


@pytest.mark.slow
@pytest.mark.timed
def test_a_killed_mapper_resumes_with_its_map(tmp_path: Path) -> None:
    """A new one would call the place where it begins the map's origin, and home would lie elsewhere."""
    path, launch = demo_launch(tmp_path, "explore", headless="true")
    with running("launch", str(path)) as (one, node):
        watched, maps = Watched(one, node, launch), list[OccupancyGrid]()
        node.subscription("/map", OccupancyGrid, maps.append, TRANSIENT_LOCAL_QOS)
        wait_for(lambda: watched.travelled() > FAR_M)
        struck(watched, "slam")
        known = len(maps)
        wait_for(lambda: len(maps) >= known + 3)
        found = quality(
            maps[-1].grid, ground_truth_map(load_any_world(WORLD, load_robot(ROBOT)), load_robot(ROBOT))
        )
        tell(f"{100 * found.precision:.1f} % of the map's walls are there")
        assert found.precision > 0.95

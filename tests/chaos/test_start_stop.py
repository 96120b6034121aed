"""Tests that repeated start and stop of a launch leaves no process and no port behind, and that stopping is quick."""

from __future__ import annotations

import statistics
import time

import pytest

from chefbot.ros2.rmw.session import RmwContext
from tests.chaos.launch_process import report, run_launch_file, wait_for
from tests.support.processes import children_of, is_alive
from tests.support.waiting import in_time

TIMES, MANY = 3, 200
MEDIAN_STOP_S = 3.0
"""Limit for the median, as some runs may be delayed by a busy machine."""


def start_and_stop() -> float:
    """Start and stop a launch, check that nothing is left, and return the seconds that stopping took."""
    with run_launch_file("two_processes.yaml") as (chefbot, node):
        wait_for(lambda: "robot_state_publisher" in {found.name for found in node.wire.graph.nodes()})
        assert chefbot.child("other") is not None
        children = children_of(chefbot.process.pid)
        began = time.monotonic()
        chefbot.stop()
        took = time.monotonic() - began
        assert chefbot.process.returncode == 0
        assert not any(map(is_alive, children))
    with RmwContext(port=chefbot.port) as again:
        assert again.is_router
    return took


@pytest.mark.rotated("launches of several processes")
@pytest.mark.timed
@pytest.mark.parametrize(
    "times", [pytest.param(TIMES, marks=pytest.mark.slow), pytest.param(MANY, marks=pytest.mark.long)]
)
def test_repeated_start_and_stop_succeeds(times: int) -> None:
    took: list[float] = []
    for done in range(1, times + 1):
        took.append(start_and_stop())
        if done in (TIMES, MANY) or done % 20 == 0:
            mean = sum(took) / done
            report(f"{done} of {times}; stopping took {max(took):.2f} s at most, {mean:.2f} s in the mean")
    assert in_time(statistics.median(took), MEDIAN_STOP_S)

"""Starting and stopping again and again leaves nothing, no process, no port, and ends soon."""

from __future__ import annotations

import statistics
import time

import pytest

from chefbot.ros2.rmw.session import RmwContext
from tests.chaos.launched import launched, tell, wait_for
from tests.support.processes import children_of, is_alive
from tests.support.waiting import in_time

TIMES, MANY = 5, 200
SHUT_S = 3.0
"""In the median: one of many may meet a machine that is busy."""


def once() -> float:
    with launched("toys.yaml") as (one, node):
        there = lambda: "frames" in {found.name for found in node.wire.graph.nodes()}  # noqa: E731
        wait_for(there)
        assert one.child("other") is not None
        children = children_of(one.process.pid)
        began = time.monotonic()
        one.stop()
        took = time.monotonic() - began
        assert one.process.returncode == 0
        assert not any(map(is_alive, children))
    with RmwContext(port=one.port) as again:
        assert again.is_router
    return took


@pytest.mark.timed
@pytest.mark.parametrize(
    "times", [pytest.param(TIMES, marks=pytest.mark.slow), pytest.param(MANY, marks=pytest.mark.long)]
)
def test_repeated_start_and_stop_succeeds(times: int) -> None:
    took: list[float] = []
    for done in range(1, times + 1):
        took.append(once())
        if done in (TIMES, MANY) or done % 20 == 0:
            mean = sum(took) / done
            tell(f"{done} of {times}; stopping took {max(took):.2f} s at most, {mean:.2f} s in the mean")
    assert in_time(statistics.median(took), SHUT_S)

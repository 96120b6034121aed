"""Tests that two launches in several processes with the same seed publish the same sequence of delivery states."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.msgs.std_msgs import Empty
from tests.chaos.delivery_launch import localized_robot
from tests.chaos.launch_process import report, wait_for

Step = tuple[str, str, tuple[str, ...], tuple[str, ...]]


def run_deliveries(folder: Path) -> list[Step]:
    """Return the delivery states of an order for two tables."""
    folder.mkdir()
    with localized_robot(folder, "seed:=7") as observer:
        taken = observer.node.publisher("/taken", Empty)
        count = len(observer.deliveries)
        observer.order("table_2", "table_1")
        for table in ("table_2", "table_1"):
            wait_for(lambda: observer.delivery_is("waiting", table))  # noqa: B023
            taken.publish(Empty())
        wait_for(lambda: observer.delivery_is("idle", ""))
        return [
            (status.state, status.place, tuple(status.queue), tuple(status.delivered))
            for status in observer.deliveries[count:]
        ]


@pytest.mark.long
def test_same_seed_gives_the_same_deliveries_in_order(tmp_path: Path) -> None:
    first, second = run_deliveries(tmp_path / "first"), run_deliveries(tmp_path / "second")
    report("\n".join(f"{state:10} {place:10} {queue} {done}" for state, place, queue, done in first))
    assert first == second
    assert first[-1] == ("idle", "", (), ("table_2", "table_1"))

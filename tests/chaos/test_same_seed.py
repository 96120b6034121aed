"""One seed twice, in several processes: the same deliveries, though not the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.msgs.std_msgs import Empty
from tests.chaos.launched import tell, wait_for
from tests.chaos.waiter import waiting_robot

Step = tuple[str, str, tuple[str, ...], tuple[str, ...]]


def delivered(folder: Path) -> list[Step]:
    """All that the waiter says it does with an order, to the end."""
    folder.mkdir()
    with waiting_robot(folder, "seed:=7") as watched:
        taken = watched.node.publisher("/taken", Empty)
        count = len(watched.deliveries)
        watched.order("table_2", "table_1")
        for table in ("table_2", "table_1"):
            wait_for(lambda: watched.has("waiting", table))  # noqa: B023
            taken.publish(Empty())
        wait_for(lambda: watched.has("idle", ""))
        return [
            (said.state, said.place, tuple(said.queue), tuple(said.delivered))
            for said in watched.deliveries[count:]
        ]


@pytest.mark.long
def test_same_seed_gives_the_same_deliveries_in_order(tmp_path: Path) -> None:
    one, other = delivered(tmp_path / "one"), delivered(tmp_path / "other")
    tell("\n".join(f"{state:10} {place:10} {queue} {done}" for state, place, queue, done in one))
    assert one == other
    assert one[-1] == ("idle", "", (), ("table_2", "table_1"))

"""The hotel demo while its processes die or hang, one in every minute of the robot's time: all the food arrives."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chefbot.demo.processes import PROCESSES
from chefbot.msgs.chefbot_msgs import DeliveryStatus, ExplorationStatus
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, TRANSIENT_LOCAL_QOS
from tests.chaos.launched import Launched, running, tell, wait_for

SEED = 8
EVERY_S = 60.0
BLOWS = [signal.SIGKILL, signal.SIGSTOP]
PATIENCE = 1800.0
"""Seconds of the wall for all of it."""


class Show:
    """What an outsider sees of the demo."""

    def __init__(self, one: Launched, node: RmwNode) -> None:
        self._one = one
        self._rng = np.random.default_rng([SEED, 0xD1F])
        self.now = 0.0
        """Seconds of the robot's time."""
        self.exploring = self.delivering = False
        node.subscription("/clock", Clock, self._tick, CLOCK)
        node.subscription("/exploration_status", ExplorationStatus, self._explore, TRANSIENT_LOCAL_QOS)
        node.subscription("/delivery_status", DeliveryStatus, self._deliver, TRANSIENT_LOCAL_QOS)

    def _tick(self, said: Clock) -> None:
        self.now = said.clock.ns / 1e9

    def _explore(self, said: ExplorationStatus) -> None:
        self.exploring = not said.done

    def _deliver(self, said: DeliveryStatus) -> None:
        self.exploring, self.delivering = False, said.state not in ("idle", "failed")

    @property
    def over(self) -> bool:
        return self._one.process.poll() is not None

    def strike(self, name: str, by: signal.Signals) -> None:
        """If it is there: it may just be on its way back."""
        if self._one.child(name) is not None:
            tell(f"{self.now:.0f} s: {name} gets {by.name}")
            self._one.kill(name, by)

    def strike_in_each_minute(self, goes_on: str) -> None:
        """Any process, by death or by hanging, as long as the attribute holds."""
        due = self.now + EVERY_S
        while getattr(self, goes_on) and not self.over:
            wait_for(lambda: self.now > due or self.over or not getattr(self, goes_on), PATIENCE)  # noqa: B023
            if self.now > due:
                due = self.now + EVERY_S
                name = list(PROCESSES)[self._rng.integers(len(PROCESSES))]
                self.strike(name, BLOWS[self._rng.integers(len(BLOWS))])


def shown(out: Path, *phases: str) -> dict[str, Any]:
    """The summary of a demo whose processes are struck in these phases."""
    words = ("demo", "--headless", "--seed", str(SEED), "--processes", "--out", str(out))
    with running(*words) as (one, node):
        show = Show(one, node)
        for phase in phases:
            wait_for(lambda: getattr(show, phase) or show.over, PATIENCE)  # noqa: B023
            show.strike_in_each_minute(phase)
        said = one.process.communicate(timeout=PATIENCE)[0]
        tell(said)
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text())
    assert one.process.returncode == 0, summary
    return summary


@pytest.mark.long
@pytest.mark.parametrize("phases", [("delivering",), ("exploring", "delivering")], ids="-".join)
def test_deliveries_succeed_while_processes_are_killed(tmp_path: Path, phases: tuple[str, ...]) -> None:
    summary = shown(tmp_path / "out", *phases)
    assert summary["success"]
    assert summary["collisions"] == 0
    assert summary["deliveries_done"] == 3

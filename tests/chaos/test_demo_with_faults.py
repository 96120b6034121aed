"""Tests that the hotel demo delivers everything although a process is killed or hangs each simulated minute."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chefbot.demo.processes import PROCESSES
from chefbot.msgs.chefbot_msgs import DeliveryStatus, ExplorationStatus
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, TRANSIENT_LOCAL_QOS
from tests.chaos.launch_process import LaunchProcess, report, run_chefbot, wait_for

SEED = 8
PERIOD_S = 60.0
FAULTS = ["killed", "hung"]
PATIENCE = 1800.0
"""Wall time that the demo may take, seconds."""


class DemoObserver:
    """A node on the network of a demo that knows its phase and sends signals to its processes."""

    def __init__(self, chefbot: LaunchProcess, node: RmwNode) -> None:
        self._chefbot = chefbot
        self._rng = np.random.default_rng([SEED, 0xD1F])
        self.now = 0.0
        """Simulated time, seconds."""
        self.exploring = self.delivering = False
        node.subscription("/clock", Clock, self._on_clock, CLOCK)
        node.subscription(
            "/exploration_status", ExplorationStatus, self._on_exploration_status, TRANSIENT_LOCAL_QOS
        )
        node.subscription("/delivery_status", DeliveryStatus, self._on_delivery_status, TRANSIENT_LOCAL_QOS)

    def _on_clock(self, message: Clock) -> None:
        self.now = message.clock.ns / 1e9

    def _on_exploration_status(self, status: ExplorationStatus) -> None:
        self.exploring = not status.done

    def _on_delivery_status(self, status: DeliveryStatus) -> None:
        self.exploring, self.delivering = False, status.state not in ("idle", "failed")

    @property
    def over(self) -> bool:
        return self._chefbot.process.poll() is not None

    def inject(self, fault: str, name: str) -> None:
        """Let a process fail, unless it is restarting at the moment."""
        if self._chefbot.child(name) is not None:
            report(f"{self.now:.0f} s: {name} is {fault}")
            self._chefbot.inject(fault, name)

    def inject_faults_during(self, phase: str) -> None:
        """Kill or suspend a random process each minute as long as the attribute named `phase` is true."""
        due = self.now + PERIOD_S
        while getattr(self, phase) and not self.over:
            wait_for(lambda: self.now > due or self.over or not getattr(self, phase), PATIENCE)  # noqa: B023
            if self.now > due:
                due = self.now + PERIOD_S
                name = list(PROCESSES)[self._rng.integers(len(PROCESSES))]
                self.inject(FAULTS[self._rng.integers(len(FAULTS))], name)


def run_demo(out: Path, *phases: str) -> dict[str, Any]:
    """Return the summary of a demo whose processes are killed or suspended in the given phases."""
    arguments = ("demo", "--headless", "--seed", str(SEED), "--processes", "--out", str(out))
    with run_chefbot(*arguments) as (chefbot, node):
        observer = DemoObserver(chefbot, node)
        for phase in phases:
            wait_for(lambda: getattr(observer, phase) or observer.over, PATIENCE)  # noqa: B023
            observer.inject_faults_during(phase)
        report(chefbot.process.communicate(timeout=PATIENCE)[0])
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text())
    assert chefbot.process.returncode == 0, summary
    return summary


@pytest.mark.long
@pytest.mark.parametrize("phases", [("delivering",), ("exploring", "delivering")], ids="-".join)
def test_deliveries_succeed_while_processes_are_killed(tmp_path: Path, phases: tuple[str, ...]) -> None:
    summary = run_demo(tmp_path / "out", *phases)
    assert summary["success"]
    assert summary["collisions"] == 0
    assert summary["deliveries_done"] == 3

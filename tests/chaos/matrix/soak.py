"""Deliveries without end: `python -m tests.chaos.matrix.soak ROBOT WORLD HOURS SECONDS`.

The robot gets a charged battery, with a new launch, when less than a third is left. The program prints a line of
JSON: simulated hours, orders, how many failed, launches, contacts, resident memory (MB), and the growth of memory
since the first quarter of an hour as a share.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from chefbot.demo.button_presser import ButtonPresser
from chefbot.launcher.session import session
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order
from chefbot.proving.run import site_of
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import Scenario
from chefbot.proving.scenario_tasks import DeliverTask, RunLimits
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.localize import start_localized

WARM_UP_H = 0.25
"""Simulated time after which all parts have their memory, h."""
MIN_CHARGE = 0.33
ORDER_TIME = 900.0
"""Time for one order, s."""
TABLES = 2
SEED = 7


class Soak:
    """A robot that is given one order after the other."""

    def __init__(self, run: SimulatedRun) -> None:
        self._run = run
        self._tables = sorted(name for name in run.places if name.startswith("table_"))
        self.orders = self.failed = self.launches = 0
        run.system.loop.add_observer(ButtonPresser(run.system.loop))

    def deliver(self) -> None:
        """Give an order and wait until it is done; launch again before it if the battery is low."""
        run = self._run
        try:
            if not self.launches or self._charge < MIN_CHARGE:
                self.launches += 1
                start_localized(run, run.true_map(), unknown=False)
            self.orders += 1
            chosen = [self._tables[i] for i in run.rng.permutation(len(self._tables))[:TABLES]]
            run.publish("order", Order(tuple(chosen)))
            run.run_until(
                lambda: self._state not in ("idle", "failed"), "the order was not accepted", ORDER_TIME
            )
            run.run_until(lambda: self._state in ("idle", "failed"), "the order was not done", ORDER_TIME)
            self.failed += self._state == "failed"
        except TaskFailedError:
            self.failed += 1

    @property
    def _charge(self) -> float:
        simulator: Any = self._run.system.nodes["simulator"]
        return float(simulator.simulation.battery.state_of_charge)

    @property
    def _state(self) -> str:
        status = self._run.latest.get("delivery_status")
        return status.state if isinstance(status, DeliveryStatus) else "idle"


def resident_megabytes() -> float:
    """Return the resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def main() -> None:
    """Deliver until the simulated time or the time on the clock is over."""
    robot, world, hours, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
    limits = RunLimits(time=1e6, wall_time=1e6)
    scenario = Scenario(name="soak", robot=robot, world=world, task=DeliverTask(tables=TABLES), limits=limits)
    spec = run_specs(scenario, Path(), [SEED])[0]
    began, first = time.monotonic(), 0.0
    with tempfile.TemporaryDirectory() as name, session(spec.robot, SEED, "simulation", 0.0, None) as system:
        run = SimulatedRun(system, scenario, SEED, site_of(spec, Path(name)), Path(name))
        soak = Soak(run)
        while run.time < hours * 3600.0 and time.monotonic() - began < seconds:
            soak.deliver()
            if not first and run.time > WARM_UP_H * 3600.0:
                first = resident_megabytes()
        memory = resident_megabytes()
        found = {
            "hours": run.time / 3600.0,
            "orders": soak.orders,
            "failed": soak.failed,
            "launches": soak.launches,
            "contacts": len(run.scorer.collisions),
            "memory": memory,
            "growth": memory / first - 1.0 if first else 0.0,
        }
    sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()

"""Delivery rounds in the simulator during which the battery becomes weak: does the robot get home, or park?

While the robot carries food, its voltage drops to a share of what it was. For each run: what the monitor made of it,
where the robot ended, whether the motor board had to stop it, and whether it takes orders once the voltage is back.

Run: python bench/bench_battery_faults.py [--robots chefbot,chefbot_lidar] [--shares 0.84,0.8] [--seeds 1,3]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from chefbot.demo.button_presser import ButtonPresser
from chefbot.launcher.session import session
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.std_msgs import String
from chefbot.proving.scenario import Scenario
from chefbot.proving.scenario_tasks import DeliverTask
from chefbot.proving.simulated_run import SimulatedRun, Site, TaskFailedError
from chefbot.proving.tasks.localize import start_localized
from chefbot.robot.load import load_robot
from chefbot.runtime.loop import Publication
from chefbot.sim.world.load import load_any_world

EMPTY = "the battery is empty"
"""What the motor board reports when it stops the motors."""


class BoardWatch:
    """Notes whether the motor board stopped the motors for the battery."""

    def __init__(self) -> None:
        self.stopped = False

    def __call__(self, publication: Publication) -> None:
        """Look at the diagnostics."""
        if isinstance(publication.message, DiagnosticArray):
            self.stopped |= any(EMPTY in status.message for status in publication.message.status)


def weak_round(run: SimulatedRun, share: float) -> str:
    """Deliver, weaken the battery with the food on the tray, and return a line of figures."""
    start_localized(run, unknown=False)
    tables = sorted(name for name in run.places if name.startswith("table_"))
    board = BoardWatch()
    for observer in (ButtonPresser(run.system.loop), board):
        run.system.loop.add_observer(observer)
    drawn = tuple(tables[i] for i in run.rng.permutation(len(tables))[:3])
    run.publish("order", Order(drawn, "first"))
    run.run_until(lambda: run.latest["delivery_status"].loaded, "the food was not loaded", 300.0)
    run.run_for(float(run.rng.uniform(2.0, 20.0)))
    run.publish("simulation/fault", String(f"voltage_drop share={share}"))
    ended = lambda: run.latest["delivery_status"].state in ("idle", "failed")  # noqa: E731
    with suppress(TaskFailedError):
        run.run_until(ended, "the round did not end", 600.0)
    run.run_for(5.0)
    status, battery = run.latest["delivery_status"], run.latest["battery_status"]
    home = run.truth.distance(run.places["home"])
    first = (
        f"{battery.level} {battery.charge:.2f}, {status.state}, {home:.2f} m from home, "
        f"served {len(status.delivered)}, board stopped {board.stopped}: {status.description!r}"
    )
    run.publish("order", Order(drawn[:1], "second"))
    run.run_for(3.0)
    second = run.latest["delivery_status"].description
    run.publish("simulation/fault", String("none"))
    run.run_for(120.0)
    run.publish("order", Order(drawn[:1], "third"))
    run.run_for(3.0)
    third = run.latest["delivery_status"]
    return f"{first}; then {second!r}; charged again: {third.state}, {third.description!r}"


def main() -> None:
    """Print a line for each robot, share and seed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", default="chefbot,chefbot_lidar")
    parser.add_argument("--world", default="hotel")
    parser.add_argument("--shares", default="0.84,0.8")
    parser.add_argument("--seeds", default="1,3")
    given = parser.parse_args()
    for name in given.robots.split(","):
        for share in map(float, given.shares.split(",")):
            for seed in map(int, given.seeds.split(",")):
                robot, cpu = load_robot(name), process_time()
                world = load_any_world(given.world, robot)
                scenario = Scenario(name="weak_battery", world=given.world, robot=name, task=DeliverTask())
                with (
                    tempfile.TemporaryDirectory() as folder,
                    session(robot, seed, "simulation", 0.0, None) as system,
                ):
                    site = Site(world, given.world, IDENTITY)
                    run = SimulatedRun(system, scenario, seed, site, Path(folder))
                    try:
                        line = weak_round(run, share)
                    except TaskFailedError as error:
                        line = str(error)
                print(
                    f"{name:14}{share:5.2f}{seed:4}  {line}  ({process_time() - cpu:.0f} s CPU)", flush=True
                )


if __name__ == "__main__":
    main()

"""Metres that a robot drives by itself while it is not localized, after it was carried elsewhere.

It delivers in a world on the true map and is carried to a random free place while it drives, `--times` times. For
each run: metres while `localization_status` is "not localized" (wanted: 0.5 at most in one loss), metres while it
is "localized" and the ground truth is more than 0.5 m away, time until it is localized again, and how the round
ended. Even seeds were used for choosing parameters, odd ones are for judging.

Run: python bench/bench_kidnap.py [--robots chefbot,chefbot_lidar] [--world hotel] [--seeds 1,3,5] [--times 2]
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
from chefbot.msgs.chefbot_msgs import DeliveryStatus, LocalizationStatus, NavigationStatus, Order
from chefbot.msgs.std_msgs import String
from chefbot.proving.scenario import Scenario
from chefbot.proving.scenario_tasks import DeliverTask
from chefbot.proving.simulated_run import SimulatedRun, Site, TaskFailedError
from chefbot.proving.tasks.localize import start_localized
from chefbot.robot.load import load_robot
from chefbot.runtime.loop import Publication
from chefbot.sim.world.load import load_any_world

JUMP = 0.3
"""Metres between two ground truths from which the robot was carried and did not drive."""
WRONG = 0.5
"""Metres between estimate and ground truth from which the pose is wrong."""
FOUND_LIMIT = 180.0
"""Seconds to wait until the robot is localized again."""


class BlindDrive:
    """Metres driven while not localized, by what the robot reports and by the ground truth."""

    def __init__(self, run: SimulatedRun) -> None:
        self._run, self._last = run, run.truth
        self._localized = True
        self.losses: list[float] = []
        """Metres driven in each loss."""
        self.unaware, self.states = 0.0, dict[str, float]()

    def __call__(self, publication: Publication) -> None:
        """Add the distance driven since the last ground truth."""
        message = publication.message
        if isinstance(message, LocalizationStatus):
            if self._localized and not message.localized:
                self.losses.append(0.0)
            self._localized = message.localized
        elif publication.topic == "ground_truth":
            step, self._last = self._last.distance(self._run.truth), self._run.truth
            if step < JUMP:
                self._add(step)

    def _add(self, step: float) -> None:
        navigation = self._run.latest.get("navigation_status")
        state = navigation.state if isinstance(navigation, NavigationStatus) else ""
        if not self._localized:
            self.losses[-1] += step
            self.states[state] = self.states.get(state, 0.0) + step
        elif self.error > WRONG:
            self.unaware += step

    @property
    def error(self) -> float:
        """Distance between estimate and ground truth, m."""
        return self._run.system.transforms.lookup("map", "base_link").distance(self._run.truth)

    @property
    def found(self) -> bool:
        """Whether the robot reports that it is localized, and is."""
        return self._localized and self.error < WRONG


def kidnap(run: SimulatedRun, times: int) -> str:
    """Deliver, and carry the robot `times` times while it drives; return a line of figures."""
    start_localized(run, unknown=False)
    tables = sorted(name for name in run.places if name.startswith("table_"))
    run.system.loop.add_observer(ButtonPresser(run.system.loop))
    drive = BlindDrive(run)
    run.system.loop.add_observer(drive)
    run.publish("order", Order(tuple(tables[i] for i in run.rng.permutation(len(tables))[:3])))
    seconds = []
    for _ in range(times):
        run.run_for(float(run.rng.uniform(4.0, 20.0)))
        run.run_until(lambda: run.latest["navigation_status"].state == "driving", "it did not drive", 120.0)
        began = run.time
        run.publish("simulation/fault", String("carried"))
        run.run_for(1.0)
        try:
            run.run_until(lambda: drive.found, "not found", FOUND_LIMIT)
            seconds.append(f"{run.time - began:.1f}")
        except TaskFailedError:
            seconds.append(f"> {FOUND_LIMIT:.0f}")
    status = run.latest["delivery_status"]
    done = lambda: run.latest["delivery_status"].state in ("idle", "failed")  # noqa: E731
    with suppress(TaskFailedError):
        run.run_until(done, "round not done", 900.0)
    status = run.latest["delivery_status"]
    assert isinstance(status, DeliveryStatus)
    states = ", ".join(f"{key} {value:.2f}" for key, value in drive.states.items() if value > 0.005)
    hits = sum("collision" in incident[3] for incident in run.safety.incidents)
    return (
        f"worst loss {max(drive.losses, default=0.0):.2f} m of {len(drive.losses)}, unaware {drive.unaware:.2f} m, "
        f"found after {' '.join(seconds)} s, hits {hits}, {status.state}: {len(status.delivered)} served, "
        f"{status.description[:90]!r} [{states}]"
    )


def main() -> None:
    """Print a line for each robot and seed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", default="chefbot,chefbot_lidar")
    parser.add_argument("--world", default="hotel")
    parser.add_argument("--seeds", default="1,3,5,7,9")
    parser.add_argument("--times", type=int, default=2)
    given = parser.parse_args()
    for name in given.robots.split(","):
        for seed in map(int, given.seeds.split(",")):
            robot, cpu = load_robot(name), process_time()
            world = load_any_world(given.world, robot)
            scenario = Scenario(
                name="kidnap", description="", world=given.world, robot=name, task=DeliverTask()
            )
            with (
                tempfile.TemporaryDirectory() as folder,
                session(robot, seed, "simulation", 0.0, None) as system,
            ):
                run = SimulatedRun(system, scenario, seed, Site(world, given.world, IDENTITY), Path(folder))
                try:
                    line = kidnap(run, given.times)
                except TaskFailedError as error:
                    line = str(error)
            print(f"{name:14}{seed:4}  {line}  ({process_time() - cpu:.0f} s CPU)", flush=True)


if __name__ == "__main__":
    main()

"""How exactly places with tolerances are reached: by the robot's own estimate, and by the simulator's truth.

The whole stack runs: localization on the true map, navigation to places drawn by the seed. For the last half metre it
prints time, path and rotation, in which manoeuvres at the goal show.

Run: python bench/bench_exact_places.py [--seeds 1,3] [--worlds room,hotel] [--robots chefbot_lidar,chefbot]
Even seeds are for tuning, odd ones for judging.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.launcher.session import session
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Header
from chefbot.proving.run import site_of
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import RunLimits, Scenario
from chefbot.proving.scenario_tasks import GoTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.localize import start_localized
from chefbot.runtime.loop import Publication

TOLERANCES = "xy_tolerance: 2 cm, yaw_tolerance: 2 deg"
NEAR, FAR = 0.5, 0.7
"""Distance from the goal from which the approach is measured, and of the start from a place that is driven to, m."""
GOALS, TIME_LIMIT = 5, 200.0
"""Places a run, and time for each, s."""


class ExactRun(SimulatedRun):
    """A run whose places ask to be reached exactly."""

    track: list[tuple[float, SE2]]

    def true_map(self) -> Path:
        """Write the tolerances into the places file, too."""
        path = super().true_map()
        places = path.with_suffix(".places.yaml")
        places.write_text(places.read_text().replace("}", f", {TOLERANCES}}}"))
        return path

    def keep_truth(self, publication: Publication) -> None:
        """Keep the true poses."""
        if isinstance(publication.message, Odometry) and publication.topic == "ground_truth":
            self.track.append((self.time, publication.message.pose.pose.se2))


def is_idle(run: SimulatedRun) -> bool:
    status: Any = run.latest.get("navigation_status")
    return not isinstance(status, NavigationStatus) or status.state == "idle"


def drive(run: ExactRun, goal: SE2) -> tuple[float, ...]:
    """Drive to a place; return errors of estimate and truth (cm, degrees), time, path (m) and rotation (degrees)."""
    run.track = []
    run.publish("goal_pose", PoseStamped(Header.of(run.system.loop.now_ns, "map"), Pose.of(goal)))
    run.run_until(lambda: not is_idle(run), "the navigator did not start", 10.0)
    run.run_until(lambda: is_idle(run), "the place was not reached", TIME_LIMIT)
    status: Any = run.latest["navigation_status"]
    if status.reason:
        raise TaskFailedError(status.reason)
    near = [(time, pose) for time, pose in run.track if pose.distance(goal) <= NEAR]
    estimate = run.system.transforms.lookup("map", "base_link")
    errors = [
        error
        for pose in (estimate, run.truth)
        for error in (100.0 * pose.distance(goal), abs(math.degrees(wrap(pose.yaw - goal.yaw))))
    ]
    path = sum(a.distance(b) for (_, a), (_, b) in pairwise(near))
    turned = sum(abs(wrap(b.yaw - a.yaw)) for (_, a), (_, b) in pairwise(near))
    return (*errors, run.time - near[0][0], path, math.degrees(turned))


def measure(world: str, robot: str, seed: int) -> list[tuple[float, ...]]:
    scenario = Scenario(
        name="exact", description="", world=world, robot=robot, task=GoTask(), limits=RunLimits(time=2000.0)
    )
    (spec,) = run_specs(scenario, Path(), [seed])
    found = []
    with (
        tempfile.TemporaryDirectory() as folder,
        session(spec.robot, seed, "simulation", 0.0, None) as system,
    ):
        run = ExactRun(system, scenario, seed, site_of(spec, Path(folder)), Path(folder))
        system.loop.add_observer(run.keep_truth)
        run.track = []
        start_localized(run, unknown=False)
        names = sorted(name for name, pose in run.places.items() if pose.distance(run.start) > FAR)
        for i in run.rng.permutation(len(names))[:GOALS]:
            try:
                found.append(drive(run, run.places[names[i]]))
                print(
                    f"{world} {robot} {seed} {names[i]}:",
                    *(f"{value:.2f}" for value in found[-1]),
                    flush=True,
                )
            except TaskFailedError as error:
                found.append((math.nan,) * 7)
                print(f"{world} {robot} {seed} {names[i]}: {error}", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("seeds", "1,3"), ("worlds", "room,hotel"), ("robots", "chefbot_lidar,chefbot")):
        parser.add_argument(f"--{name}", default=default)
    args = parser.parse_args()
    titles = "estimate cm, deg; truth cm, deg; last half metre: s, m, deg"
    print(titles)
    for robot in args.robots.split(","):
        rows = np.array(
            [
                row
                for world in args.worlds.split(",")
                for seed in args.seeds.split(",")
                for row in measure(world, robot, int(seed))
            ]
        )
        exact = np.mean((rows[:, 0] <= 2.0) & (rows[:, 1] <= 2.0))
        print(f"{robot}: {exact:.0%} of {len(rows)} within tolerance; median, then maximum of {titles}")
        for summary in (np.nanmedian, np.nanmax):
            print(" ", *(f"{value:.2f}" for value in summary(rows, axis=0)))


if __name__ == "__main__":
    main()

"""How often the kept reasons of stops and detours agree with the simulator's truth: what stood there, and when.

Drives through generated offices among people of all kinds who also open and close doors, with boxes dropped on the
path. A reason agrees if something that can touch the robot stood within 0.12 m of its place when the mark was made,
and is on the map or not, as the reason states. The guess beside it takes the same distance in a random direction and
draws whether the map has it as often as the reasons of the run say so.

Run: python bench/bench_causes.py [--seeds 1,3,5] [--robot chefbot_lidar] [--people 6] [--verbose]
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.causes.reports import DETOUR, END, FAILURE, SLOW, STOP
from chefbot.demo.summary import mapping_sensor_height
from chefbot.launcher.session import session
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.proving.run import site_of
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import Building, Scenario
from chefbot.proving.scenario_tasks import GoTask, RunLimits
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.go import go
from chefbot.proving.true_causes import TrueCauses
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.sim.world.floor_plan import floor_plan

BOX_PERIOD = 40.0
"""Time between two boxes that fall before the robot, s."""
BOX_DISTANCE = 1.2
"""Distance ahead at which they fall, m."""
WRONG_POSE = 0.5
"""Error of the pose above which the robot is lost without knowing it, m: what it sees is not where its map has it."""
NAMES = "slow-downs", "stops", "detours", "failures"


def scenario_of(robot: str, people: int) -> Scenario:
    """Return drives among people of all kinds."""
    kinds = PeopleSpec(count=people, stand_and_talk=0.2, step_out=0.1, doors=0.2, follow=0.1, block=0.1)
    return Scenario(
        name="causes",
        world=Building(kind="office", numbers={"width": 16.0, "depth": 12.0}),
        robot=robot,
        people=kinds,
        task=GoTask(goals=3),
        limits=RunLimits(time=600.0),
    )


class DroppedBoxes:
    """Drops a box before the robot from time to time, as an operator does in the web UI."""

    def __init__(self, run: SimulatedRun) -> None:
        self._run, self._next = run, BOX_PERIOD

    def __call__(self, publication: Any) -> None:
        """Drop the next one when it is due; one that would fall on somebody is refused by the simulator."""
        if publication.topic != "ground_truth" or self._run.time < self._next:
            return
        self._next += BOX_PERIOD
        pose = self._run.truth
        x, y = pose.x + BOX_DISTANCE * math.cos(pose.yaw), pose.y + BOX_DISTANCE * math.sin(pose.yaw)
        stamped = PoseStamped(Header.of(publication.time_ns, "map"), Pose.of(SE2(x, y, 0.0)))
        self._run.publish("simulation/drop_box", stamped)


def drive(scenario: Scenario, seed: int, folder: Path) -> tuple[TrueCauses, str]:
    """Make one drive; return what was judged, and why it failed, or an empty string."""
    (spec,) = run_specs(scenario, Path(), [seed])
    site = site_of(spec, folder)
    with session(spec.robot, seed, "simulation", 0.0, folder / "run.mcap") as system:
        run = SimulatedRun(system, scenario, seed, site, folder)
        heights = ground_clearance(spec.robot), overall_height(spec.robot)
        judge: list[TrueCauses] = []

        def observe(publication: Any) -> None:
            if not judge and run.safety.simulation is not None:
                grid = floor_plan(run.world, mapping_sensor_height(spec.robot))
                judge.append(TrueCauses(run.safety.simulation, heights, grid, seed))
            if judge:
                judge[0](publication)

        system.loop.add_observer(observe)
        system.loop.add_observer(DroppedBoxes(run))
        failure = ""
        try:
            go(run)
        except TaskFailedError as error:
            failure = str(error)
    return judge[0], failure


def main() -> None:
    """Print agreement by kind of cause and by check, and what standing was explained."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1,3,5,7,9")
    parser.add_argument("--robot", default="chefbot_lidar")
    parser.add_argument("--people", type=int, default=6)
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--out", type=Path, help="folder for the logs; default: none are kept")
    given = parser.parse_args()
    judged, stood, explained = [], 0, 0
    for seed in (int(text) for text in given.seeds.split(",")):
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) if given.out is None else given.out / f"seed_{seed}"
            folder.mkdir(parents=True, exist_ok=True)
            truth, failure = drive(scenario_of(given.robot, given.people), seed, folder)
        judged += truth.judged
        reasons = truth.standing.explained(truth.causes)
        stood, explained = stood + len(reasons), explained + sum(reasons)
        agree = sum(one.agrees for one in truth.judged)
        begun = [cause for cause in truth.causes if cause.kind != END]
        print(
            f"seed {seed}: {agree} of {len(truth.judged)} places agree, {len(begun)} causes, "
            f"{sum(reasons)} of {len(reasons)} stands explained; {failure or 'all goals reached'}",
            flush=True,
        )
        for one in truth.judged:
            if given.verbose or not one.agrees:
                print(f"   {'ok' if one.agrees else 'NO'} {describe(one.cause)}; truth: {one.truth}")
    print_table(judged)
    print(f"{explained} of {stood} times that the robot stood for 1 s or more with a goal have a reason")


def describe(cause: Cause) -> str:
    """Return a cause in a line."""
    return (
        f"{cause.header.stamp.ns / 1e9:7.2f} s {cause.kind} {cause.check}: {cause.obstacle}: {cause.sentence}"
    )


def print_table(judged: list[Any]) -> None:
    """Print how many causes of each kind and check agree, and how many the guess would."""
    rows = [
        (name, [one for one in judged if one.cause.kind == kind])
        for name, kind in zip(NAMES, (SLOW, STOP, DETOUR, FAILURE), strict=True)
    ]
    checks = sorted({one.cause.check for one in judged})
    rows += [(check, [one for one in judged if one.cause.check == check]) for check in checks]
    rows += [
        ("stops and detours", [one for one in judged if one.cause.kind in (STOP, DETOUR)]),
        ("all", judged),
        (f"all, pose within {WRONG_POSE} m", [one for one in judged if one.pose_error <= WRONG_POSE]),
    ]
    print(f"{'':26}{'places':>8}{'agree':>8}{'share':>8}{'guess':>8}")
    for name, chosen in rows:
        if chosen:
            share = np.mean([one.agrees for one in chosen])
            guess = np.mean([one.guess_agrees for one in chosen])
            print(f"{name:26}{len(chosen):8}{sum(one.agrees for one in chosen):8}{share:8.1%}{guess:8.1%}")


if __name__ == "__main__":
    main()

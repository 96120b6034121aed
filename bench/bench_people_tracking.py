"""Tracked people against the simulator's truth, while a robot drives through buildings among people.

A person is in sight if two returns of the sensor or more lie within 0.3 m of it, within 5 m; it is tracked if a track
is within 0.5 m. A track that counts as visible and is farther than 0.8 m from everybody for half a second is false.
The whole stack runs: localization on the true map, navigation from place to place.

Run: python bench/bench_people_tracking.py [--seconds 60] [--seeds 1,3,5] [--worlds hotel,office,home] [--robots ...]
Even seeds are for tuning, odd ones for judging.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.launcher.session import session
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.people.observation import observe_obstacles, observe_scan
from chefbot.proving.run import site_of
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import Building, RunLimits, Scenario
from chefbot.proving.scenario_tasks import GoTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.go import go
from chefbot.runtime.loop import Publication
from chefbot.runtime.transform_buffer import TransformError
from chefbot.sim.world.world import built_in_worlds

SIGHT, NEAR, RETURNS = 5.0, 0.3, 2
"""Distance within which people count, m; distance of their returns from the middle, m; and the number of returns."""
MATCH, FALSE_DISTANCE, FALSE_UPDATES = 0.5, 0.8, 5
"""Distance of a track from its person, and of a false one from everybody, m; updates from which one counts."""
VELOCITY_TIME = 0.2
"""Time over which the true velocity is measured, s."""
KINDS = {"stand_and_talk": 0.34, "groups": 0.34, "pull_chairs": 0.17}


@dataclass
class Moment:
    """What was true when a sensor measured: robot and people in the world, m, and the returns in the sensor frame."""

    robot: SE2
    people: np.ndarray
    frame: str
    returns: np.ndarray


@dataclass
class Score:
    """Counts over all updates of some runs."""

    in_sight: int = 0
    tracked: int = 0
    switches: int = 0
    minutes: float = 0.0
    false_tracks: int = 0
    errors: list[float] = field(default_factory=list)
    velocity_errors: list[float] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)

    def add(self, other: Score) -> None:
        """Add the counts of another run."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)

    def row(self) -> str:
        """Return a line of the table."""
        return (
            f"{self.tracked / max(self.in_sight, 1):8.1%}{self.in_sight:8}"
            f"{self.false_tracks / max(self.minutes, 1e-9):10.2f}{_median(self.errors):9.3f}"
            f"{_median(self.velocity_errors):9.2f}{self.switches:6}{1e3 * _mean(self.costs):9.2f}"
            f"{1e3 * float(np.percentile(self.costs or [0.0], 99)):9.2f}"
        )


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else math.nan


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan


class Judge:
    """Compares each message of the tracker with what was true at its time."""

    def __init__(self, run: SimulatedRun, has_lidar: bool) -> None:
        self.score, self._run, self._sensor = Score(), run, "scan" if has_lidar else "obstacles"
        self._moments: dict[int, Moment] = {}
        self._last: dict[int, int] = {}
        self._before: dict[int, tuple[float, np.ndarray]] = {}
        self._false = Counter[int]()
        run.system.loop.add_observer(self._observe)

    def _observe(self, publication: Publication) -> None:
        message = publication.message
        if publication.topic == self._sensor and self._run.safety.simulation is not None:
            self._keep(message)
        elif isinstance(message, TrackedPeople):
            self._compare(message)

    def _keep(self, message: Any) -> None:
        simulation: Any = self._run.safety.simulation
        people = np.array([pose[:2] for pose in simulation.people]).reshape(-1, 2)
        here = SE2(0.0, 0.0, 0.0)
        seen = observe_scan(message, here) if isinstance(message, LaserScan) else _seen(message, here)
        returns = seen.points()[np.isfinite(seen.ranges)]
        moment = Moment(simulation.truth().pose, people, message.header.frame_id, returns)
        self._moments[message.header.stamp.ns] = moment

    def _compare(self, message: TrackedPeople) -> None:
        stamp = message.header.stamp.ns
        moment, tf = self._moments.pop(stamp, None), self._run.system.nodes["people_tracker"].tf
        if moment is None:
            return
        try:
            sensor = tf.lookup("odom", moment.frame, stamp)
            world_T_odom = moment.robot @ tf.lookup("odom", "base_link", stamp).inverse()
        except TransformError:
            return
        people = world_T_odom.inverse().apply(moment.people)
        returns = sensor.apply(moment.returns)
        tracks = np.array([(p.position.x, p.position.y) for p in message.people]).reshape(-1, 2)
        for k, person in enumerate(people):
            seen = (np.hypot(*(returns - person).T) < NEAR).sum() >= RETURNS
            if seen and math.hypot(person[0] - sensor.x, person[1] - sensor.y) < SIGHT:
                self._judge(k, person, tracks, message.people, stamp / 1e9)
            self._note(k, person, stamp / 1e9)
        self._count_false(people, tracks, message)
        self.score.minutes += 1.0 / 600.0

    def _judge(
        self, k: int, person: np.ndarray, tracks: np.ndarray, given: tuple[TrackedPerson, ...], now: float
    ) -> None:
        """Judge a person in sight."""
        self.score.in_sight += 1
        distances = np.hypot(*(tracks - person).T)
        if not len(tracks) or distances.min() > MATCH:
            return
        track = given[int(distances.argmin())]
        self.score.tracked += 1
        self.score.errors.append(float(distances.min()))
        self.score.switches += self._last.get(k, track.id) != track.id
        self._last[k] = track.id
        then, there = self._before.get(k, (-math.inf, person))
        if now - then < 2.0 * VELOCITY_TIME:
            vx, vy = (person - there) / (now - then)
            self.score.velocity_errors.append(math.hypot(track.velocity.x - vx, track.velocity.y - vy))

    def _note(self, k: int, person: np.ndarray, now: float) -> None:
        if k not in self._before or now - self._before[k][0] >= VELOCITY_TIME:
            self._before[k] = (now, person)

    def _count_false(self, people: np.ndarray, tracks: np.ndarray, message: TrackedPeople) -> None:
        for track, given in zip(tracks, message.people, strict=True):
            distances = np.hypot(*(people - track).T)
            if given.visible and (not len(people) or distances.min() > FALSE_DISTANCE):
                self._false[given.id] += 1
                self.score.false_tracks += self._false[given.id] == FALSE_UPDATES


def _seen(message: Any, here: SE2) -> Any:
    assert isinstance(message, ObstacleScan)
    return observe_obstacles(message, here)


def judged(robot: str, world: str, count: int, seed: int, seconds: float) -> Score:
    """Drive through a world among people and return the score."""
    people = PeopleSpec(count=count, avoid_robot=seed % 4 == 1, **KINDS)
    place = world if world in built_in_worlds() else Building(kind=world)
    scenario = Scenario(
        name="tracking",
        world=place,
        robot=robot,
        people=people,
        task=GoTask(goals=50),
        limits=RunLimits(time=seconds),
    )
    spec = run_specs(scenario, Path(), [seed])[0]
    with (
        tempfile.TemporaryDirectory() as folder,
        session(spec.robot, seed, "simulation", 0.0, None) as system,
    ):
        run = SimulatedRun(system, scenario, seed, site_of(spec, Path(folder)), Path(folder))
        judge = Judge(run, spec.robot.sensors.lidar is not None)
        launch = run.launch
        run.launch = lambda *given: (launch(*given), _time_updates(system, judge.score))[0]  # type: ignore[method-assign]
        with contextlib.suppress(TaskFailedError):  # the time is up
            go(run)
        return judge.score


def _time_updates(system: Any, score: Score) -> None:
    """Measure the CPU time of the tracker's updates."""
    tracker = system.nodes["people_tracker"]._tracker
    update = tracker.update

    def timed(*given: Any) -> bool:
        began = time.thread_time()
        result: bool = update(*given)
        score.costs.append(time.thread_time() - began)
        return result

    tracker.update = timed


def main() -> None:
    """Print a row for each robot and world, and one for each robot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seeds", default="1,3")
    parser.add_argument("--worlds", default="hotel,office,home")
    parser.add_argument("--robots", default="chefbot_lidar,chefbot")
    parser.add_argument("--people", type=int, default=6)
    given = parser.parse_args()
    head = f"{'in sight tracked':>16}{'of':>8}{'false/min':>10}{'error m':>9}{'v m/s':>9}{'ids':>6}"
    print(f"{'robot and world':28}{head[8:]}{'mean ms':>9}{'p99 ms':>9}")
    for robot in given.robots.split(","):
        total = Score()
        for world in given.worlds.split(","):
            score = Score()
            for seed in map(int, given.seeds.split(",")):
                score.add(judged(robot, world, given.people, seed, given.seconds))
            print(f"{robot + ' ' + world:28}{score.row()}", flush=True)
            total.add(score)
        print(f"{robot:28}{total.row()}", flush=True)


if __name__ == "__main__":
    main()

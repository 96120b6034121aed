"""What people cost the simulator, in CPU time of the calling thread.

The whole simulator runs: physics, board with firmware, lidar and depth images at their rates, in the hotel. Runs with
and without people take turns, a simulated second each.

Run: python bench/bench_people.py
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.robot.load import load_robot
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.cameras.depth_camera import DepthRenderer
from chefbot.sim.device import BOARD_HZ
from chefbot.sim.simulation import PHYSICS_STEP, STEPS_PER_MOVER_UPDATE, Simulation
from chefbot.sim.world.world import load_world

ALL_KINDS = PeopleSpec(
    count=12,
    stand_and_talk=0.17,
    groups=0.17,
    step_out=0.08,
    pull_chairs=0.17,
    doors=0.08,
    follow=0.08,
    block=0.08,
)
CASES: dict[str, PeopleSpec] = {
    "none": PeopleSpec(),
    "12": PeopleSpec(count=12),
    "12 of all kinds": ALL_KINDS,
    "50": PeopleSpec(count=50),
}
ROUNDS = 15


class Run:
    """A robot that turns in the hotel, with all its sensors."""

    def __init__(self, robot_name: str, people: PeopleSpec) -> None:
        robot = load_robot(robot_name)
        self._robot, self.people_seconds, self.seconds = robot, list[float](), list[float]()
        self._sim = Simulation(robot, load_world("hotel"), "real", 1, people=people)
        self._board = SimulatedBoard(robot, self._sim)
        camera = robot.sensors.depth_camera
        self._renderer = None if camera is None else DepthRenderer(camera, "real", 1)
        self._tick = 0

    def second(self) -> None:
        """Simulate a second, then a second of the people alone, and note the CPU time of both."""
        begun = time.thread_time()
        for _ in range(BOARD_HZ):
            self._board.command(1.0, 1.5)
            self._board.run_until(self._board.now_ns + 1_000_000_000 // BOARD_HZ)
            self._read_sensors()
        self.seconds.append(time.thread_time() - begun)
        begun = time.thread_time()
        duration = STEPS_PER_MOVER_UPDATE * PHYSICS_STEP
        for _ in range(round(1.0 / duration)):
            self._sim.advance_movers(duration)
        self.people_seconds.append(time.thread_time() - begun)

    def _read_sensors(self) -> None:
        self._tick += 1
        sensors = self._robot.sensors
        if sensors.lidar is not None and self._is_due(sensors.lidar.rate):
            self._sim.lidar()
        if self._renderer is not None and self._is_due(sensors.depth_camera.rate):  # type: ignore[union-attr]
            self._renderer.frame(self._sim.capture(), self._tick, False)

    def _is_due(self, rate: float) -> bool:
        return self._tick % max(1, round(BOARD_HZ / rate)) == 0


def print_table(robot: str, runs: dict[str, Run]) -> None:
    """Print the medians of each run, and its ratio to the run without people in the same round."""
    print(
        f"{robot:24}{'ms per s':>10}{'ratio':>8}{'people':>10}{'share':>8}   (ms of CPU per simulated second)"
    )
    for name, run in runs.items():
        ratio = _median(a / b for a, b in zip(run.seconds, runs["none"].seconds, strict=True))
        total, people = _median(run.seconds) * 1e3, _median(run.people_seconds) * 1e3
        print(f"{name + ' people':24}{total:10.1f}{ratio:8.2f}{people:10.2f}{people / total:8.1%}")
    print()


def _median(values: Iterable[float]) -> float:
    return statistics.median(list(values))


def main() -> None:
    """Print a table for a robot with a depth camera, and one for a robot with a lidar as well."""
    for robot in ("chefbot", "chefbot_lidar"):
        runs = {name: Run(robot, people) for name, people in CASES.items()}
        for n in range(ROUNDS + 2):
            for run in runs.values():
                run.second()
                if n < 2:  # kernels, first paths
                    run.seconds.clear()
                    run.people_seconds.clear()
        print_table(robot, runs)


if __name__ == "__main__":
    main()

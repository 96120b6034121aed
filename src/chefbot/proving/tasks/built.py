"""Task `built`: the final run of the book's chapter on the bytes of emulated hardware, in real time."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chefbot.demo.score import ARRIVAL_TOLERANCE
from chefbot.errors import UserError
from chefbot.maths.grid import FREE
from chefbot.maths.se2 import SE2
from chefbot.proving.built_robot import BuiltSetup, HardwareProcess, RobotProcess
from chefbot.proving.record import GoalRecord
from chefbot.proving.run_spec import RunSpec
from chefbot.proving.scenario_tasks import BuiltTask
from chefbot.proving.simulated_run import TaskFailedError
from chefbot.robot.load import built_in_robots
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.free_floor import MARGIN
from chefbot.sim.world.world import World

STANDING_TIME, GOAL_TIMEOUT = 4.0, 180.0
"""Time after which the robot stands, and time for one goal, s."""
MIN_DRIVE = 3.0
"""Distance that the robot must have driven before its return to the start counts, m."""


class BuiltRun(NamedTuple):
    """Results of a run: figures, path and goals."""

    figures: dict[str, float]
    path: list[tuple[float, float, float]]
    goals: list[GoalRecord]


class BuiltDrive:
    """One run of the chapter: map, save the map, restart, localize, drive to goals."""

    def __init__(self, spec: RunSpec, world: World, name: str, folder: Path) -> None:
        scenario = spec.scenario
        if spec.robot.name not in built_in_robots():
            raise UserError(f"robot {spec.robot.name}: the task `built` needs a built-in robot")
        assert isinstance(scenario.task, BuiltTask)
        self._robot, self._world, self._task = spec.robot, world, scenario.task
        self._setup = BuiltSetup(spec.robot.name, name, scenario.profile, spec.seed, folder)
        self._limit = scenario.limits.time
        self._rng = np.random.default_rng([spec.seed, 0xB017])
        self._map = folder / "map"
        self.goals: list[GoalRecord] = []
        self.errors: list[float] = []
        self.hardware = HardwareProcess(self._setup)

    def run(self) -> None:
        """Run all steps. Raises TaskFailedError for a step that failed."""
        hardware = self.hardware
        hardware.wait(lambda: bool(hardware.states), "the hardware did not start", GOAL_TIMEOUT)
        self._map_the_building()
        self._deliver_to_goals()

    def _map_the_building(self) -> None:
        """Explore, return to the start and save the map."""
        hardware = self.hardware
        with closing(RobotProcess(self._setup, hardware, "explore")) as robot:
            hardware.wait(self._has_returned, "the building was not mapped", self._limit)
            robot.command("map", "save", "-f", str(self._map))

    def _has_returned(self) -> bool:
        at_start = self.hardware.pose.distance(SE2(0.0, 0.0, 0.0)) < ARRIVAL_TOLERANCE
        return at_start and self.path_length > MIN_DRIVE and self.hardware.stands(STANDING_TIME)

    def _deliver_to_goals(self) -> None:
        """Restart on the saved map, at the start, and drive to the goals by the command of the operator."""
        given = f"map_file:={self._map}.yaml"
        with closing(RobotProcess(self._setup, self.hardware, "amcl_demo", given)) as robot:
            robot.layer("robot")
            for goal in drawn_goals(self._world, self._robot, self._rng, self._task.goals):
                self._drive(robot, goal)
        missed = [goal.place for goal in self.goals if not goal.reached]
        if missed:
            raise TaskFailedError(f"not reached: {', '.join(missed)}")

    def _drive(self, robot: RobotProcess, goal: SE2) -> None:
        hardware, began, reason = self.hardware, self.hardware.newest.time, ""
        robot.command(
            "drive", "goto", "--", f"{goal.x:.3f}", f"{goal.y:.3f}", f"{math.degrees(goal.yaw):.1f}"
        )

        def arrived() -> bool:
            return hardware.pose.distance(goal) < ARRIVAL_TOLERANCE and hardware.stands(STANDING_TIME)

        try:
            hardware.wait(arrived, "the goal was not reached", GOAL_TIMEOUT)
        except TaskFailedError as error:
            reason = str(error)
        shown = robot.layer("robot")
        self.errors.append(hardware.pose.distance(SE2(shown["x"], shown["y"], shown["yaw"])))
        distance, ended = hardware.pose.distance(goal), hardware.newest.time
        place = f"({goal.x:.1f}, {goal.y:.1f})"
        record = GoalRecord(
            place=place,
            began=began,
            ended=ended,
            reached=not reason,
            distance=round(distance, 3),
            reason=reason,
        )
        self.goals.append(record)

    @property
    def path_length(self) -> float:
        """Distance that the robot has driven, m."""
        places = np.array([state.pose[:2] for state in self.hardware.states])
        return float(np.hypot(*np.diff(places, axis=0).T).sum()) if len(places) > 1 else 0.0

    def result(self) -> BuiltRun:
        """Return the results of the run."""
        states = self.hardware.states
        figures = {
            "time": states[-1].time if states else 0.0,
            "path_length": self.path_length,
            "collisions": float(states[-1].collisions) if states else 0.0,
        }
        if self.goals:
            figures["goals_reached"] = sum(goal.reached for goal in self.goals) / self._task.goals
            figures["localization_error_max"] = max(self.errors)
            figures["localization_error_median"] = float(np.median(self.errors))
        return BuiltRun(figures, [state.pose for state in states[::5]], self.goals)


def drawn_goals(world: World, robot: Robot, rng: np.random.Generator, count: int) -> list[SE2]:
    """Return poses on the floor that the robot can get to, in the frame that begins at its start."""
    floor = reachable(world, robot, MARGIN)
    cells = np.argwhere(floor.cells == FREE)
    goals: list[SE2] = []
    before = SE2(0.0, 0.0, 0.0)
    while len(goals) < count:
        row, column = rng.choice(cells)
        x = floor.origin_x + (column + 0.5) * floor.resolution
        y = floor.origin_y + (row + 0.5) * floor.resolution
        goal = world.start.between(SE2(float(x), float(y), float(rng.uniform(-math.pi, math.pi))))
        if goal.distance(before) > 2.0 * ARRIVAL_TOLERANCE:
            goals.append(goal)
            before = goal
    return goals


def drive_built(spec: RunSpec, world: World, name: str, folder: Path) -> tuple[str, BuiltRun]:
    """Make the run; return a sentence if it failed, and its results. Raises UserError if it cannot begin."""
    failure = ""
    drive = BuiltDrive(spec, world, name, folder)
    with closing(drive.hardware):
        try:
            drive.run()
        except TaskFailedError as error:
            failure = str(error)
    return failure, drive.result()

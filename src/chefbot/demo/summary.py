"""Summary of a demo's results."""

from __future__ import annotations

import platform
from importlib.metadata import version

import msgspec

from chefbot import __version__
from chefbot.demo.demo import Demo
from chefbot.demo.score import error_statistics
from chefbot.mapping.compare import MapQuality, quality
from chefbot.maths.grid import Grid
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.observable_floor import observable_floor
from chefbot.sim.world.world import World


class DemoResult(msgspec.Struct, frozen=True, kw_only=True):
    """Content of summary.json; metres, seconds, fractions from 0 to 1. None: there was nothing to measure."""

    success: bool
    failure: str
    world: str
    robot: str
    profile: str
    seed: int
    people: int
    tables: list[str]
    deliveries_done: int
    collisions: int
    touched_objects: list[str]
    explored_fraction: float | None
    map_precision: float | None
    map_recall: float | None
    slam_error_m: dict[str, float | None]
    localization_error_m: dict[str, float | None]
    path_length_m: float
    sim_time_s: float
    wall_time_s: float
    real_time_factor: float
    recoveries: int
    left_unexplored: list[str]
    cpu_s: dict[str, float]
    """CPU time of each process if there were several, s."""
    versions: dict[str, str]

    def to_json(self) -> str:
        """Return the result as indented JSON."""
        return msgspec.json.format(msgspec.json.encode(self), indent=2).decode() + "\n"

    def table(self) -> list[tuple[str, str]]:
        """Return the lines of the table that the demo prints at its end."""
        error = self.localization_error_m
        return [
            ("deliveries", f"{self.deliveries_done} of {len(self.tables)} ({', '.join(self.tables)})"),
            ("collisions", f"{self.collisions} {', '.join(self.touched_objects)}"),
            ("explored", _percent(self.explored_fraction)),
            ("map precision, recall", f"{_percent(self.map_precision)}, {_percent(self.map_recall)}"),
            ("error while mapping", _errors(self.slam_error_m)),
            ("error on the saved map", _errors(error)),
            ("path", f"{self.path_length_m:.1f} m, {self.recoveries} recoveries"),
            (
                "time",
                f"{self.sim_time_s:.0f} s in {self.wall_time_s:.0f} s: real-time factor {self.real_time_factor:.1f}",
            ),
        ]


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.1f} %"


def _errors(values: dict[str, float | None]) -> str:
    if values["median"] is None:
        return "-"
    return f"median {values['median']:.3f} m, p95 {values['p95']:.3f} m, max {values['max']:.3f} m"


def ground_truth_map(world: World, robot: Robot) -> Grid:
    """Return the map that the robot's mapping sensor would make of the world without any error."""
    return floor_plan(world, mapping_sensor_height(robot), frame=world.start)


def map_quality(grid: Grid, world: World, robot: Robot) -> MapQuality:
    """Return the quality of a map that the robot made of what it can observe of the world."""
    plan = ground_truth_map(world, robot)
    return quality(grid, plan, observable_floor(world, robot, plan))


def mapping_sensor_height(robot: Robot) -> float:
    """Return the height above the floor of the sensor that the robot maps with, m."""
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    assert sensor is not None  # a robot file without both is refused
    return sensor.mount.z


def summarize(demo: Demo) -> DemoResult:
    """Compute the result of a demo that has ended."""
    scorer, options = demo.scorer, demo.options
    sim_time = demo.system.loop.now_ns / 1e9
    found = _map_quality(demo)
    deliveries = len(set(scorer.delivered) & set(demo.tables))
    failure = demo.failure or _failure_of(demo, deliveries)
    return DemoResult(
        success=not failure,
        failure=failure,
        world=demo.world.name,
        robot=demo.robot.name,
        profile=options.profile,
        seed=options.seed,
        people=options.people,
        tables=demo.tables,
        deliveries_done=deliveries,
        collisions=len(scorer.collisions),
        touched_objects=sorted(set(scorer.collisions)),
        explored_fraction=None if found is None else round(found.explored, 4),
        map_precision=None if found is None else round(found.precision, 4),
        map_recall=None if found is None else round(found.recall, 4),
        slam_error_m=error_statistics(scorer.mapping.errors()),
        localization_error_m=error_statistics(scorer.delivering.errors()),
        path_length_m=round(scorer.path_length, 2),
        sim_time_s=round(sim_time, 2),
        wall_time_s=round(demo.wall_time, 2),
        real_time_factor=round(sim_time / demo.wall_time, 2),
        recoveries=scorer.recoveries,
        left_unexplored=list(demo.explored.skipped_frontiers),
        cpu_s={} if demo.processes is None else demo.processes.cpu_time,
        versions=_versions(),
    )


def _failure_of(demo: Demo, deliveries: int) -> str:
    faults = demo.system.faults.counts if demo.system.faults else {}
    if demo.fault or faults:
        return f"a node failed: {demo.fault or next(iter(faults))}"
    if deliveries < len(demo.tables):
        return f"only {deliveries} of {len(demo.tables)} tables were truly reached"
    if demo.scorer.collisions:
        return f"the robot touched {', '.join(sorted(set(demo.scorer.collisions)))}"
    return "" if demo.scorer.at_home() else "the robot is not at home"


def _map_quality(demo: Demo) -> MapQuality | None:
    """Compare the maps without aligning their frames: both begin at the robot's start."""
    if demo.scorer.saved_map is None:
        return None
    return map_quality(demo.scorer.saved_map, demo.world, demo.robot)


def _versions() -> dict[str, str]:
    names = ("numpy", "numba", "mujoco-core", "scipy")
    return {
        "chefbot": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in names},
    }

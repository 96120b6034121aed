"""What the robot does in a scenario, and how a run is judged."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Count = Annotated[int, Meta(ge=1, le=100)]
Seconds = Annotated[float, Meta(gt=0, le=1e6, extra={"unit": "s"})]


class ExploreTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="explore"):
    """Map the world autonomously and return to the start."""


class MapLogTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="map_log"):
    """Map a recorded CARMEN log, and compare the trajectory with relations between true poses."""

    log: Annotated[str, Meta(description="CARMEN log, gzip-compressed or not, beside the scenario file")]
    relations: Annotated[
        str, Meta(description="file of true relations (Kuemmerle et al. 2009): t1 t2 x y z roll pitch yaw")
    ] = ""
    particles: Annotated[int, Meta(ge=1, le=1000, description="particles of the mapper")] = 30
    max_range: Annotated[
        float, Meta(gt=0, le=1000, description="ranges from here on count as no return, m")
    ] = 80.0


class LocalizeTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="localize"):
    """Find the pose on the true map of the world."""

    initial_pose: Annotated[
        Literal["unknown", "approximate"],
        Meta(description="unknown: global localization; approximate: 0.5 m and 20 degrees off"),
    ] = "unknown"


class GoTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="go"):
    """Drive to places on the true map, in order, from an approximately known pose."""

    goals: Annotated[Count, Meta(description="number of places, drawn from the world's by the seed")] = 3


class PassDoorTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="pass_door"):
    """Drive through the only door of a room while it is blocked for a time, from an approximately known pose.

    Start, door and goal are drawn by the seed, from the places on the two sides of the world's doors.
    """

    event: Annotated[
        Literal["talk", "crowd", "close", "block", "any"],
        Meta(
            description="two people talk in the door, a crowd stands in it, it is closed, a person blocks the robot, "
            "or one of these by the seed"
        ),
    ] = "any"
    hold: Annotated[Seconds, Meta(description="time for which it lasts from the robot's arrival on")] = 60.0
    crowd: Annotated[int, Meta(ge=1, le=6, description="people of a crowd")] = 4


class DeliverTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="deliver"):
    """Fetch food in the kitchen, serve tables and return home."""

    tables: Annotated[Count, Meta(description="number of tables, drawn from the world's by the seed")] = 3
    map: Annotated[
        Literal["true", "explored"],
        Meta(
            description="true: the world's, from an approximately known pose; explored: one that the robot "
            "makes first, as in `chefbot demo`"
        ),
    ] = "true"

    @property
    def explores(self) -> bool:
        """Whether the robot makes the map."""
        return self.map == "explored"


class DriveRandomlyTask(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="drive_randomly"
):
    """Drive by random teleoperation while mapping; the driver looks ahead unless `careful` is false."""

    duration: Annotated[float, Meta(gt=0, le=100_000, description="time to drive, s")] = 120.0
    careful: Annotated[bool, Meta(description="whether the driver turns away from what is ahead")] = True


class BuiltTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="built"):
    """The final run of the book's chapter on a built robot: map, save, restart, localize, drive to goals.

    In real time. Board and lidar are emulated at pseudo-terminals; the robot's processes know nothing of a simulator.
    """

    goals: Annotated[Count, Meta(description="number of goals, drawn on the reachable floor by the seed")] = 2


Task = (
    ExploreTask
    | MapLogTask
    | LocalizeTask
    | GoTask
    | PassDoorTask
    | DeliverTask
    | DriveRandomlyTask
    | BuiltTask
)
TASKS: tuple[type[msgspec.Struct], ...] = (
    ExploreTask,
    MapLogTask,
    LocalizeTask,
    GoTask,
    PassDoorTask,
    DeliverTask,
    DriveRandomlyTask,
    BuiltTask,
)


def makes_map(task: msgspec.Struct) -> bool:
    """Return whether the robot maps the world in this task; the frame of its map begins at its start."""
    return isinstance(task, ExploreTask | DriveRandomlyTask) or (
        isinstance(task, DeliverTask) and task.explores
    )


def task_name(task: msgspec.Struct | type[msgspec.Struct]) -> str:
    """Return the name of a task as in a scenario file."""
    tag = task.__struct_config__.tag
    assert isinstance(tag, str)
    return tag


class Bounds(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Bounds of a figure: a run outside them has failed."""

    min: float | None = None
    max: float | None = None

    @property
    def can_be_kept(self) -> bool:
        """Whether there is a bound, and a value that keeps all of them."""
        given = [bound for bound in (self.min, self.max) if bound is not None]
        return bool(given) and given[0] <= given[-1]

    def violated_by(self, value: float) -> bool:
        """Return whether a figure lies outside; NaN always does."""
        above = self.min is None or value >= self.min
        below = self.max is None or value <= self.max
        return not (above and below)


class RunLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of one run; a run that reaches one has failed."""

    time: Annotated[Seconds, Meta(description="simulated time")] = 1800.0
    wall_time: Annotated[Seconds, Meta(description="time on the clock, for a run that hangs")] = 1800.0
    memory: Annotated[
        float, Meta(ge=300, le=100_000, description="resident memory of the run's process, MB")
    ] = 3000.0

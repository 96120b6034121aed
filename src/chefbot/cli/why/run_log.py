"""The causes, the map and the robot's path in the log of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from chefbot.causes.history import CauseHistory, CauseSpan
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.ros2.bag.reader import Bag, read_bag

RUNS = Path("runs")
OTHER_CLOCK_NS = 3_600_000_000_000
"""Time by which a log begins after its first cause only if it was written on another clock, ns."""
M = TypeVar("M", bound=Message)


class RunCauses(NamedTuple):
    """What a log has about causes.

    spans: oldest first. grid: the last static map, or None. began_ns: when it begins on the robot's clock. cut: a
    sentence if the log ends too early, else empty.
    """

    path: Path
    spans: list[CauseSpan]
    grid: Grid | None
    began_ns: int
    cut: str


def find_log(given: Path | None) -> Path:
    """Return the log file of a run's folder or file, or the newest in runs/. Raises UserError for none."""
    if given is None:
        logs = sorted(RUNS.rglob("*.mcap"), key=lambda path: path.stat().st_mtime) if RUNS.is_dir() else []
        if not logs:
            raise UserError(f"there is no log in {RUNS}/; name a run: chefbot why --log RUN")
        return logs[-1]
    if not given.exists():
        raise UserError(f"there is no run {given}")
    if given.is_file():
        return given
    logs = sorted(given.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    if not logs:
        raise UserError(f"the folder {given} has no log (run.mcap)")
    return logs[-1]


def read_run(path: Path) -> RunCauses:
    """Read the causes of a log. Raises UserError for a file that is not a log, and for one without causes."""
    try:
        bag = read_bag(path)
        _check_type(bag, path)
        causes = _messages(bag, "/causes", Cause)
        maps = _messages(bag, "/map", OccupancyGrid)
    except ChefbotError as error:
        raise UserError(str(error)) from None
    cut = bag.truncated[0] if bag.truncated else ""
    if not causes:
        if not bag.topics:
            raise UserError(f"log {path} holds no message{': it ends too early' if cut else ''}")
        raise UserError(f"log {path} holds no causes: nothing slowed the robot down, or none were recorded")
    grid = maps[-1].grid if maps else None
    spans = CauseHistory(causes).spans
    return RunCauses(path, spans, grid, _begin_of(bag, spans), cut)


def _begin_of(bag: Bag, spans: list[CauseSpan]) -> int:
    """Return the begin of a log on the clock of its causes, ns.

    A simulated robot's clock begins at 0, `chefbot bag record` notes wall time.
    """
    first_ns = min(span.began_ns for span in spans)
    return min(bag.start_ns, first_ns) if bag.start_ns - first_ns < OTHER_CLOCK_NS else 0


def _check_type(bag: Bag, path: Path) -> None:
    for topic in bag.topics:
        kind = {"/causes": Cause, "/map": OccupancyGrid}.get(topic.name)
        if kind is not None and topic.kind.name != ros_type(kind):
            raise UserError(f"log {path}: topic {topic.name} carries {topic.kind.name}, not {ros_type(kind)}")


def _messages(bag: Bag, topic: str, kind: type[M]) -> list[M]:
    found: Any = [kind.from_cdr(message.data) for message in bag.messages({topic})]
    return found

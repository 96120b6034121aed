"""The rows of the reliability matrix: a fault, what is promised for it, and the checks that measure it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
import yaml
from msgspec import Meta

from chefbot.proving.scenario_tasks import DeliverTask, ExploreTask, GoTask

FILE = Path(__file__).parent / "rows.yaml"
ROOT = Path(__file__).parents[3]


class SuiteCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="tests"):
    """Test files or single tests that must pass; each is a unit of its own.

    select: tests of them, as an expression of pytest's `-k`.
    """

    paths: list[str]
    select: str = ""


class RunCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="runs"):
    """Runs on the proving ground: each robot in each world with each fault, or with each pair of the faults.

    worlds: built-in worlds, or kinds of buildings. faults: fault events without their times. contact_speed: speed
    of the fastest contact that is allowed, m/s.
    """

    robots: list[str]
    worlds: list[str]
    task: ExploreTask | GoTask | DeliverTask
    faults: list[dict[str, Any]]
    pairs: bool = False
    people: int = 0
    contact_speed: float = 0.0


class SoakCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="soak"):
    """Deliveries without end: memory must not grow by more than `growth`, a share, in `hours` of simulated time."""

    robot: str
    world: str
    hours: float
    growth: float


Check = SuiteCheck | RunCheck | SoakCheck


class Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A row of the matrix.

    unmeasured: why a part of the promise, or all of it, is not measured; a clause without a full stop.
    """

    id: Annotated[str, Meta(pattern=r"^R\d{1,2}$")]
    fault: str
    target: str
    checks: list[Check] = []
    unmeasured: str = ""


def load_rows(path: Path = FILE) -> list[Row]:
    """Return all rows in their order."""
    return msgspec.convert(yaml.safe_load(path.read_text()), list[Row])

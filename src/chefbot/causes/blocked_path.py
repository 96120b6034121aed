"""The report of a blocked path: what the robot decided, and the obstacle in the way."""

from __future__ import annotations

from chefbot.causes.reports import MarkedPlace, make_report
from chefbot.msgs.chefbot_msgs import Cause, FindBlockage_Result, Quantity

BLOCKED, REQUESTED = "blocked path", "blocked path, requested to pass"
"""Names of the checks."""


def blocked_path_report(
    kind: str, check: str, sentence: str, numbers: tuple[Quantity, ...], found: FindBlockage_Result
) -> Cause:
    """Return the report of a decision about a blocked path: its kind, check, sentence and numbers.

    Its place is the cell in the way, unless that is somebody who walks.
    """
    stands = any(one.name == "stood" and one.value > 0.0 for one in numbers)
    located = bool(found.sensor) and (stands or not len(found.people))
    point = found.point
    place = MarkedPlace(found.sensor, "map", point.x, point.y, found.marked_at.ns) if located else None
    return make_report(kind, check, sentence, place, numbers)

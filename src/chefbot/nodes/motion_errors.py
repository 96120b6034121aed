"""Error codes of Nav2's behaviours: nav2_msgs/action/Spin, BackUp, DriveOnHeading."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.behavior.behavior import Progress


class Errors(NamedTuple):
    """Codes of one of Nav2's behaviours."""

    unknown: int
    timeout: int
    collision: int
    invalid: int = 0


SPIN, BACK_UP, DRIVE = Errors(700, 701, 703), Errors(710, 711, 714, 713), Errors(720, 721, 723, 724)


def motion_error(end: Progress, errors: Errors) -> tuple[int, str]:
    """Error code and sentence of a motion's end."""
    codes = {Progress.BLOCKED: errors.collision, Progress.TIMED_OUT: errors.timeout}
    return (codes[end], f"{end.value[0].upper()}{end.value[1:]}.") if end in codes else (0, "")

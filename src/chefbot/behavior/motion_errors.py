"""Error codes of Nav2's behaviors: nav2_msgs/action/Spin, BackUp, DriveOnHeading."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.behavior.behavior import BehaviorProgress


class BehaviorErrorCodes(NamedTuple):
    """Error codes of one of Nav2's behavior actions."""

    unknown: int
    timeout: int
    collision: int
    invalid: int = 0


SPIN, BACK_UP, DRIVE = (
    BehaviorErrorCodes(700, 701, 703),
    BehaviorErrorCodes(710, 711, 714, 713),
    BehaviorErrorCodes(720, 721, 723, 724),
)


def motion_error(progress: BehaviorProgress, errors: BehaviorErrorCodes) -> tuple[int, str]:
    """Return the error code and message for the final progress of a motion."""
    codes = {BehaviorProgress.BLOCKED: errors.collision, BehaviorProgress.TIMED_OUT: errors.timeout}
    if progress not in codes:
        return 0, ""
    return codes[progress], f"{progress.value[0].upper()}{progress.value[1:]}."

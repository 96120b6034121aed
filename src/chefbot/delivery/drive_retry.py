"""Retries of a drive: the navigator is missing, the path to the kitchen or home is blocked, the robot is lost."""

from __future__ import annotations

NO_NAVIGATOR = 9000
"""Error code UNKNOWN of nav2_msgs/action/NavigateToPose; here: the navigator died or is not available."""
NO_VALID_PATH = 208
"""NO_VALID_PATH of nav2_msgs/action/ComputePathToPose: an obstacle or a person blocks the only path."""
BLOCKED_PATH_TIMEOUT, BLOCKED_RETRY_PERIOD = 1800.0, 10.0
"""Time for which a blocked path to the kitchen or home is retried, and period of the retries, s.

The navigator waits for people for minutes in each of them. A blocked table is skipped instead, because the robot can
serve the next one."""
NAVIGATOR_TIMEOUT = 120.0
"""Time without a navigator after which a place counts as not reached, s: restarting a process may take a minute on a
busy computer."""
LOST_TIMEOUT, LOST_RETRY_PERIOD = 900.0, 10.0
"""Time for which a drive is retried whose robot is not localized, and pause between its searches, s: somebody sets
the initial pose. All other places would fail for the same reason."""
RETRY_PERIOD = 0.5
"""Retry period while the places or the navigator are not available, s."""


class DriveRetry:
    """Decides after each attempt of one drive whether there is another one. Times are in ns."""

    def __init__(self) -> None:
        self._failing_since_ns: int | None = None

    def pause(
        self, code: int, start_ns: int, now_ns: int, *, required: bool, lost: bool = False
    ) -> float | None:
        """Return the pause (s) before the next attempt, or None if the result of this one is final.

        code: error code of the attempt from `start_ns` until `now_ns`, 0 if the place was reached. required: whether
        the round cannot go on without the place, as the kitchen or home, to which the map has a path. lost: whether
        the robot is not localized.
        """
        was_active = code == NO_NAVIGATOR and (now_ns - start_ns) / 1e9 > NAVIGATOR_TIMEOUT
        if self._failing_since_ns is None or was_active:
            self._failing_since_ns = now_ns
        if now_ns >= self._failing_since_ns + round(_patience(code, required, lost and code != 0) * 1e9):
            return None
        if lost:
            return LOST_RETRY_PERIOD
        return BLOCKED_RETRY_PERIOD if code == NO_VALID_PATH else RETRY_PERIOD


def _patience(code: int, required: bool, lost: bool) -> float:
    """Return the time (s) since the first failure for which a drive with this error code is retried."""
    if lost:
        return LOST_TIMEOUT
    if code == NO_NAVIGATOR:
        return NAVIGATOR_TIMEOUT
    return BLOCKED_PATH_TIMEOUT if required and code == NO_VALID_PATH else 0.0

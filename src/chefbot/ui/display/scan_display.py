"""Shows scans that differ from the last one by more than noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.ui.display.views import ScanView

NOISE, NOISE_GROWTH = 0.06, 0.01
"""Difference of a range up to which it is noise, m, and its growth with the square of the range, 1/m, of a camera."""
MIN_RUN, NOISY_SHARE = 4, 0.02
"""Number of neighbouring ranges that differ by more from which they count, and the share of those that may: single
beams at edges jump, and a camera has no data in single directions; a person covers more of them."""
MOVED_DISTANCE, TURNED_ANGLE = 0.01, 0.005
"""Motion of the sensor from which its scan is new, m and rad."""


class ScanDisplay:
    """Remembers the scan that each layer shows: a robot at rest need not send the same walls ten times a second.

    What differs must do so in two scans in a row: in single scans a camera has no data in whole groups of directions.
    """

    def __init__(self, set_layer: Callable[[str, ScanView], None]) -> None:
        self._set_layer = set_layer
        self._shown: dict[str, ScanView] = {}
        self._changed: dict[str, NDArray[np.bool_]] = {}

    def show(self, layer: str, sensor: SE2 | None, message: LaserScan | ObstacleScan) -> None:
        """Show a scan from the sensor's pose in the map, if that is known and the scan shows something new."""
        if sensor is None:
            return
        scan = ScanView(sensor, message.angles, message.ranges, message.header.frame_id)
        if self._is_new(layer, scan):
            self._shown[layer] = scan
            self._changed.pop(layer, None)
            self._set_layer(layer, scan)

    def _is_new(self, layer: str, scan: ScanView) -> bool:
        """Return whether a scan shows something else than the one that is shown."""
        shown = self._shown.get(layer)
        if (
            shown is None
            or len(scan.ranges) != len(shown.ranges)
            or _has_moved(SE2(*shown.pose), SE2(*scan.pose))
        ):
            return True
        changed = _changed_ranges(shown, scan)
        both = changed & self._changed.get(layer, np.zeros_like(changed))
        self._changed[layer] = changed
        return _count_in_runs(both) > NOISY_SHARE * len(changed)


def _has_moved(shown: SE2, pose: SE2) -> bool:
    return shown.distance(pose) > MOVED_DISTANCE or abs(wrap(pose.yaw - shown.yaw)) > TURNED_ANGLE


def _changed_ranges(shown: ScanView, scan: ScanView) -> NDArray[np.bool_]:
    """Return which ranges (n,) of a scan differ by more than noise, or have come or gone."""
    seen, before = np.isfinite(scan.ranges), np.isfinite(shown.ranges)
    noise = NOISE + NOISE_GROWTH * np.where(seen, scan.ranges, 0.0) ** 2
    with np.errstate(invalid="ignore"):
        far = np.abs(np.where(seen & before, np.asarray(scan.ranges) - shown.ranges, 0.0)) > noise
    changed: NDArray[np.bool_] = far | (seen != before)
    return changed


def _count_in_runs(changed: NDArray[np.bool_]) -> int:
    """Return how many of the changed ranges (n,) have enough changed neighbours."""
    edges = np.flatnonzero(np.diff(changed.astype(np.int8), prepend=0, append=0))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= MIN_RUN].sum())

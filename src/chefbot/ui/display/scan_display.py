"""Shows scans that differ from the last one by more than noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

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
    """Remembers the scan that each layer shows: a robot at rest need not send the same walls ten times a second."""

    def __init__(self, set_layer: Callable[[str, ScanView], None]) -> None:
        self._set_layer = set_layer
        self._shown: dict[str, ScanView] = {}

    def show(self, layer: str, sensor: SE2 | None, message: LaserScan | ObstacleScan) -> None:
        """Show a scan from the sensor's pose in the map, if that is known and the scan shows something new."""
        if sensor is None:
            return
        scan = ScanView(sensor, message.angles, message.ranges, message.header.frame_id)
        if layer not in self._shown or differs(self._shown[layer], scan):
            self._shown[layer] = scan
            self._set_layer(layer, scan)


def differs(shown: ScanView, scan: ScanView) -> bool:
    """Return whether a scan shows something else than another: from elsewhere, or more than noise."""
    (x, y, yaw), (shown_x, shown_y, shown_yaw) = scan.pose, shown.pose
    turned = abs(float(np.angle(np.exp(1j * (yaw - shown_yaw)))))
    if (
        np.hypot(x - shown_x, y - shown_y) > MOVED_DISTANCE
        or turned > TURNED_ANGLE
        or len(scan.ranges) != len(shown.ranges)
    ):
        return True
    seen, before = np.isfinite(scan.ranges), np.isfinite(shown.ranges)
    noise = NOISE + NOISE_GROWTH * np.where(seen, scan.ranges, 0.0) ** 2
    with np.errstate(invalid="ignore"):
        far = np.abs(np.where(seen & before, np.asarray(scan.ranges) - shown.ranges, 0.0)) > noise
    return _count_in_runs(far | (seen != before)) > NOISY_SHARE * len(scan.ranges)


def _count_in_runs(changed: NDArray[np.bool_]) -> int:
    """Return how many of the changed ranges (n,) have enough changed neighbours."""
    edges = np.flatnonzero(np.diff(changed.astype(np.int8), prepend=0, append=0))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= MIN_RUN].sum())

"""Shows scans that differ from the last one by more than noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.ui.display.views import ScanView

NOISE = 0.06
"""Difference of a range up to which it is noise, m."""
NOISY_SHARE = 0.02
"""Share of the ranges that may differ by more: single beams at edges jump; a person covers more of them."""
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
    with np.errstate(invalid="ignore"):
        far = np.abs(np.where(seen & before, np.asarray(scan.ranges) - shown.ranges, 0.0)) > NOISE
    return bool(np.count_nonzero(far | (seen != before)) > NOISY_SHARE * len(scan.ranges))

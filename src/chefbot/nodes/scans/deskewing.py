"""Scans with the pose of a frame at their time, without the skew of a lidar that turns while the robot moves."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.runtime.transform_buffer import TransformBuffer, TransformError
from chefbot.scan.deskewing import deskewed, knot_times

FIXED_FRAME = "odom"
"""Frame in which the motion during a scan is known: that of the map jumps."""
_NEWEST: WeakKeyDictionary[TransformBuffer, tuple[LaserScan, LaserScan]] = WeakKeyDictionary()
"""The newest scan of each loop as measured and without skew: several nodes of a loop need it."""


def when_deskewed(
    tf: TransformBuffer, scan: LaserScan, frame: str, action: Callable[[LaserScan, SE2], None]
) -> None:
    """Call `action` with the scan without skew and the pose of `frame` in odom at its stamp, once both are known.

    A scan that began before the first odometry is left out: of a robot that turns meanwhile, its skew would turn a
    new map by half the angle. A scan in an unknown frame is given as it is.
    """
    times = knot_times(scan)

    def place(_: SE2) -> None:
        try:
            tf.lookup(FIXED_FRAME, frame, min(times))
        except TransformError:
            return
        action(_deskewed(tf, scan, times), tf.lookup(FIXED_FRAME, frame, times[0]))

    if len(times) == 1:
        tf.on_available(FIXED_FRAME, frame, times[0], lambda pose: action(scan, pose))
    else:
        tf.on_available(FIXED_FRAME, frame, max(times[0], times[-1]), place)


def _deskewed(tf: TransformBuffer, scan: LaserScan, times: list[int]) -> LaserScan:
    measured, result = _NEWEST.get(tf, (None, scan))
    if measured is not scan:
        result = _without_skew(tf, scan, times)
        _NEWEST[tf] = scan, result
    return result


def _without_skew(tf: TransformBuffer, scan: LaserScan, times: list[int]) -> LaserScan:
    try:
        return deskewed(scan, [tf.lookup(FIXED_FRAME, scan.header.frame_id, time_ns) for time_ns in times])
    except TransformError:
        return scan

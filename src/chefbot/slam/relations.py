"""Relation error of a trajectory (Kuemmerle et al. 2009, "On measuring the accuracy of SLAM algorithms")."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedOdometry, RecordedScan

Array = NDArray[np.float64]
COLUMNS = 8
"""Columns of a relation: t1, t2 (s), x, y, z (m), roll, pitch, yaw (rad)."""


class RelationsError(ChefbotError):
    """A file of relations that cannot be used."""


def parse_relations(text: str) -> Array:
    """Return the relations (n, 8), see COLUMNS; lines that begin with # are comments.

    Raises RelationsError with the line for anything else.
    """
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        try:
            rows.append([float(field) for field in fields])
        except ValueError:
            raise RelationsError(f"line {number}: a relation is {COLUMNS} numbers") from None
        if len(fields) != COLUMNS or not np.isfinite(rows[-1]).all():
            raise RelationsError(f"line {number}: a relation is {COLUMNS} finite numbers")
    if not rows:
        raise RelationsError("there is no relation in it")
    return np.array(rows)


def track_of_log(
    records: Sequence[RecordedOdometry | RecordedScan], stamps: Sequence[float], poses: Sequence[SE2]
) -> Array:
    """Return rows (t, x, y, yaw), one a record: the pose of the last processed scan and the odometry since.

    An odometry reading with the stamp of a processed scan is left out.
    """
    processed = dict(zip(stamps, poses, strict=True))
    rows: list[list[float]] = []
    base: SE2 | None = None
    origin = SE2(0.0, 0.0, 0.0)
    for record in records:
        if isinstance(record, RecordedScan) and record.stamp in processed:
            base, origin = processed[record.stamp], record.odom
        elif record.stamp in processed:
            continue  # the scan of this stamp has the better pose
        if base is not None:
            rows.append([record.stamp, *(base @ origin.between(record.odom))])
    return np.array(sorted(rows, key=lambda row: row[0])).reshape(-1, 4)


def relation_errors(track: Array, relations: Array) -> Array:
    """Return the errors (n,) of the relative positions, m: |xy(inv(pose(t1)) pose(t2)) - xy(relation)|.

    track: rows (t, x, y, yaw) in order of time, between which poses are interpolated linearly.
    """
    t, first = np.unique(track[:, 0], return_index=True)
    columns = (track[first, 1], track[first, 2], np.unwrap(track[first, 3]))
    x1, y1, yaw = (np.interp(relations[:, 0], t, column) for column in columns)
    x2, y2, _ = (np.interp(relations[:, 1], t, column) for column in columns)
    # Position at t2 in the frame of the pose at t1.
    dx, dy, c, s = x2 - x1, y2 - y1, np.cos(yaw), np.sin(yaw)
    return np.hypot(c * dx + s * dy - relations[:, 2], c * dy - s * dx - relations[:, 3])

"""Search for the pose of a scan in a likelihood field.

Olson, Real-Time Correlative Scan Matching, ICRA 2009: all poses of a window are scored, first with a coarse step.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.slam.graph.surface_grid import CELL, FIELD_MAX


@njit(cache=True, nogil=True)
def correlate(points, prior, information, beams, window, steps, field, origin):  # type: ignore[no-untyped-def]
    """Return the pose (3,) of highest posterior in a window around `prior` (3,), and its mean field value, 0 to 1.

    points: (n, 2) float32 in the base frame, m. information: (3, 3) of the odometry prior. beams: number of
    independent beams that the scan counts as. window: half widths in m and rad. steps: step in m and rad.
    """
    n = len(points)
    linear, angular = math.ceil(window[0] / steps[0]), math.ceil(window[1] / steps[1])
    best, best_value, best_score = prior.copy(), -1e300, 0.0
    column, row = np.empty(n, np.float64), np.empty(n, np.float64)
    height, width = field.shape
    for k in range(-angular, angular + 1):
        turn = k * steps[1]
        c, s = math.cos(prior[2] + turn), math.sin(prior[2] + turn)
        # Points in cells at this heading
        for i in range(n):
            column[i] = (c * points[i, 0] - s * points[i, 1] + prior[0] - origin[0]) / CELL
            row[i] = (s * points[i, 0] + c * points[i, 1] + prior[1] - origin[1]) / CELL
        for b in range(-linear, linear + 1):
            for a in range(-linear, linear + 1):
                dx, dy = a * steps[0], b * steps[0]
                shift_x, shift_y = dx / CELL, dy / CELL
                total = 0
                for i in range(n):
                    u, v = column[i] + shift_x, row[i] + shift_y
                    if u >= 0.0 and v >= 0.0 and u < width and v < height:
                        total += field[int(v), int(u)]
                score = total / (n * FIELD_MAX)
                # Log posterior: likelihood of the independent beams and odometry
                cost = 0.5 * (
                    information[0, 0] * dx * dx + 2.0 * information[0, 1] * dx * dy + information[1, 1] * dy * dy
                    + information[2, 2] * turn * turn
                )  # fmt: skip
                value = beams * score - cost
                if value > best_value:
                    best_value, best_score = value, score
                    best[0], best[1], best[2] = prior[0] + dx, prior[1] + dy, prior[2] + turn
    return best, best_score

"""Global nearest neighbour association of measurements to tracks, within a gate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

NO_TRACK = -1


def associate(
    costs: NDArray[np.float64], gate: float, slots: int = 1, extra: float = 0.0
) -> NDArray[np.int64]:
    """Return the track of each measurement, (m,), NO_TRACK for none.

    costs: (tracks, m), at least 0; NaN and inf exclude a pair. gate: cost from which a pair is excluded; it is also
    the cost of leaving a measurement without a track. A track takes up to `slots` measurements; all but the first
    cost `extra` more. The sum of costs is minimal (Kuhn 1955).
    """
    tracks, m = costs.shape
    found = np.full(m, NO_TRACK, np.int64)
    if tracks == 0 or m == 0:
        return found
    # What a pair saves against leaving the measurement alone; 0 for what is excluded, so that it is never preferred.
    saved = np.concatenate([gate - costs - (extra if slot else 0.0) for slot in range(slots)])
    saved = np.where(np.isfinite(saved), np.maximum(saved, 0.0), 0.0)
    rows, columns = linear_sum_assignment(saved, maximize=True)
    chosen = saved[rows, columns] > 0.0
    found[columns[chosen]] = rows[chosen] % tracks
    return found

"""Measurement of the latency of the wheels: how long after a command the odometry shows its speed."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

WINDOW = 40
"""Commands that are compared with the odometry."""
MIN_CHANGE = 0.1
"""Change of the commanded speed within the window, as a share of the maximum speed, that makes the latency
visible."""
MIN_ERROR = 0.5
"""Deviation (root mean square) that a wrong latency must cause, as a share of that change."""
MAX_LATENCY = 0.5
"""Largest latency that is measured, s."""
MIN_GAIN = 0.5
"""Share of the error that a latency must explain to count: else a wheel slips or somebody pushes."""
SMOOTHING = 0.2
"""Weight of a new measurement."""


class LatencyEstimator:
    """Estimates the latency from commanded and measured speeds, one pair per period.

    period: time between two commands, s. max_speed: m/s. initial: latency before the first measurement, s.
    """

    def __init__(self, period: float, max_speed: float, initial: float) -> None:
        self.latency = initial
        """The estimate, s."""
        self._period, self._max_speed = period, max_speed
        self._commanded: deque[float] = deque(maxlen=WINDOW)
        self._measured: deque[float] = deque(maxlen=WINDOW)

    def process(self, commanded: float, measured: float) -> None:
        """Process the speed commanded now and the newest measured one, m/s."""
        self._commanded.append(commanded)
        self._measured.append(measured)
        if len(self._commanded) == WINDOW:
            shift = self._best_shift(np.array(self._commanded), np.array(self._measured))
            if shift is not None:
                self.latency += SMOOTHING * (shift * self._period - self.latency)

    def _best_shift(self, commanded: NDArray[np.float64], measured: NDArray[np.float64]) -> int | None:
        """Return by how many periods the measured speeds lag, None if they do not show it."""
        max_shift = round(MAX_LATENCY / self._period)
        change = MIN_CHANGE * self._max_speed
        if np.ptp(measured[max_shift:]) < change:
            return None
        # Mean squared errors by the number of periods that the commanded speeds are shifted
        shifted = sliding_window_view(commanded, WINDOW - max_shift)[::-1]
        errors = np.square(measured[max_shift:] - shifted).mean(axis=1)
        best, largest = int(errors.argmin()), float(errors.max())
        visible = largest >= (MIN_ERROR * change) ** 2
        return best if visible and errors[best] <= (1.0 - MIN_GAIN) * largest else None

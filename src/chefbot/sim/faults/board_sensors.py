"""Faults of the motor board's sensors, between the physical reading and the pin or register that the board reads."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.sim.faults.events import (
    SensorFault,
    SensorFreeze,
    SensorLate,
    SensorNoise,
    SensorOffset,
    SensorStop,
    SensorUpsideDown,
)

Reading = NDArray[np.float64]
IMU_FLIP: Reading = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0])
"""Signs of the IMU's registers (ax ay az temperature gx gy gz) turned by 180 degrees about x."""
TEMPERATURE, TURN_RATE = 3, 6


class FaultyReading:
    """A reading (n,) of a sensor with the active faults applied to it."""

    def __init__(self, rng: Generator, offset: Reading | None = None) -> None:
        """`offset`: what one unit of the fault `offset` adds to the reading."""
        self.faults: tuple[SensorFault, ...] = ()
        self._rng, self._offset = rng, offset
        self._held: Reading | None = None
        self._delayed: deque[tuple[int, Reading]] = deque()

    def set_faults(self, faults: tuple[SensorFault, ...]) -> None:
        """Set the active faults; a freeze repeats the first reading from now on."""
        self.faults, self._held = faults, None
        self._delayed.clear()

    @property
    def stopped(self) -> bool:
        """Whether the sensor does not answer."""
        return any(isinstance(fault, SensorStop) for fault in self.faults)

    def apply(self, reading: Reading, now_ns: int) -> Reading:
        """Return what the board reads instead of `reading`, taken at `now_ns`."""
        if self._held is None:
            self._held = reading
        delays = [fault.seconds for fault in self.faults if isinstance(fault, SensorLate)]
        if delays:
            self._delay(reading, now_ns, max(delays))
        elif not any(isinstance(fault, SensorFreeze) for fault in self.faults):
            self._held = reading
        changed = self._held
        for fault in self.faults:
            changed = self._changed(changed, fault)
        return changed

    def _delay(self, reading: Reading, now_ns: int, seconds: float) -> None:
        """Hold the newest reading that is old enough."""
        self._delayed.append((now_ns, reading))
        while self._delayed and now_ns - self._delayed[0][0] >= seconds * 1e9:
            self._held = self._delayed.popleft()[1]

    def _changed(self, reading: Reading, fault: SensorFault) -> Reading:
        if isinstance(fault, SensorNoise):
            return reading * (1.0 + fault.share * self._rng.standard_normal(reading.shape))
        if isinstance(fault, SensorOffset) and self._offset is not None:
            return reading + self._offset * (fault.range or fault.rate)
        if isinstance(fault, SensorUpsideDown):
            return reading * IMU_FLIP
        return reading


class FaultyEncoders:
    """Quarter steps of the encoders: what is not counted is lost, what is late is counted later."""

    def __init__(self, rng: Generator) -> None:
        self.faults: tuple[SensorFault, ...] = ()
        self._rng = rng
        self._rest: Reading = np.zeros(2)
        self._delayed: deque[tuple[int, tuple[int, int]]] = deque()

    def apply(self, steps: tuple[int, int], now_ns: int) -> tuple[int, int]:
        """Return the quarter steps (left, right) that reach the board instead of `steps`, turned until `now_ns`."""
        if not self.faults and not self._delayed:
            return steps
        if any(isinstance(fault, (SensorStop, SensorFreeze)) for fault in self.faults):
            steps = (0, 0)
        for fault in self.faults:
            if isinstance(fault, SensorNoise):
                steps = self._miscounted(steps, fault.share)
        return self._late_steps(steps, now_ns)

    def _miscounted(self, steps: tuple[int, int], share: float) -> tuple[int, int]:
        exact = self._rest + np.array(steps) * (1.0 + share * self._rng.standard_normal(2))
        whole = np.rint(exact)
        self._rest = exact - whole
        return int(whole[0]), int(whole[1])

    def _late_steps(self, steps: tuple[int, int], now_ns: int) -> tuple[int, int]:
        """Delay the steps; when no fault delays them any more, all that are under way are counted at once."""
        delay_ns = max(
            (fault.seconds * 1e9 for fault in self.faults if isinstance(fault, SensorLate)), default=0.0
        )
        self._delayed.append((now_ns, steps))
        left = right = 0
        while self._delayed and now_ns - self._delayed[0][0] >= delay_ns:
            _, (more_left, more_right) = self._delayed.popleft()
            left, right = left + more_left, right + more_right
        return left, right

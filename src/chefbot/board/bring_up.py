"""What the first motions of a newly wired board show: which wheel turned, which way, how far and how quickly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.board.messages import BoardLine, MotionLine
from chefbot.board.status_codes import LATCHED, BoardFlag, faults
from chefbot.maths.counter_unwrap import wrap_signed

SIDES = ("left", "right")
MIN_SHARE, CROSSTALK = 0.5, 0.1
"""Shares of the expected ticks: the minimum of a wheel that turns, and the maximum of one that stands."""
TURN_TOLERANCE = 0.03
"""Share by which a turn by hand may differ from the robot file's ticks per turn."""
BEGIN_US = 300_000
"""Time after which a commanded motion has begun, us."""
OVERSHOOT, STEADY_ERROR = 0.2, 0.05
"""Shares of the speed beyond which a step response is poor."""


class WheelRun(NamedTuple):
    """One wheel was commanded to turn forward slowly, the other to stand.

    side: 0 for the left wheel, 1 for the right one. ticks: counted by both encoders. expected: ticks that the
    commanded wheel should have made. flags: of the board, at the end.
    """

    side: int
    ticks: tuple[int, int]
    expected: float
    flags: int


def wheel_findings(run: WheelRun) -> list[str]:
    """Return what the encoders and the board show to be wrong, as sentences with the remedy; none if all is right."""
    name, other = SIDES[run.side], SIDES[1 - run.side]
    own, foreign = run.ticks[run.side], run.ticks[1 - run.side]
    encoder = BoardFlag.ENCODER_RIGHT if run.side else BoardFlag.ENCODER_LEFT
    if abs(foreign) > MIN_SHARE * run.expected > abs(own):
        return [
            f"The {other} encoder counted while the {name} wheel was driven: swap the connectors of the two"
            " encoders, or of the two motors."
        ]
    if run.flags & encoder and own < 0:
        return [
            f"The {name} encoder counts against its motor: swap its A and B wires, or the motor's two wires."
        ]
    if run.flags & encoder:
        return [
            f"The {name} encoder counted nothing while its motor was driven: check its supply, ground, A and B."
        ]
    found = [f"{text[0].upper()}{text[1:]}." for text in faults(run.flags)]
    if not found and own < MIN_SHARE * run.expected:
        found.append(f"The {name} encoder counted {own} ticks, but {run.expected:.0f} were commanded.")
    if not found and abs(foreign) > CROSSTALK * run.expected:
        found.append(f"The {other} wheel turned as well, by {foreign} ticks: look for crossed wires.")
    return found


def direction_remedy(side: int, answer: str) -> str:
    """Return what to do after a wheel was seen to turn backward ('b') or not to turn ('n'); empty if forward."""
    name = SIDES[side]
    if answer == "b":
        return f"Swap the two wires of the {name} motor, and the A and B wires of its encoder: both are reversed."
    if answer == "n":
        return (
            f"The {name} encoder counts, but the wheel stands: the connectors of the motors may be swapped."
        )
    return ""


def was_interrupted(lines: Sequence[BoardLine]) -> bool:
    """Return whether the board has had no speed for a while, once the motion had begun, and without a fault."""
    motions = [line for line in lines if isinstance(line, MotionLine)]
    begun = [line for line in motions if wrap_signed(line.t - motions[0].t) > BEGIN_US]
    return not begun or any(
        line.flags & (BoardFlag.NO_SPEED | LATCHED) == BoardFlag.NO_SPEED for line in begun
    )


class HandTurn(NamedTuple):
    """A wheel was turned forward by hand for so many turns."""

    ticks: int
    turns: int
    expected: float

    @property
    def ratio(self) -> float:
        """Counted ticks per turn by those of the robot file."""
        return self.ticks / self.turns / self.expected

    @property
    def agrees(self) -> bool:
        """Whether the encoder counts as the robot file has it."""
        return abs(self.ratio - 1.0) <= TURN_TOLERANCE


class StepResponse(NamedTuple):
    """How a wheel follows a step of its speed.

    rise_time: until 90 % of the speed, s, infinite if it is never reached. overshoot, error: shares of the speed; the
    error is that of the mean over the last third.
    """

    rise_time: float
    overshoot: float
    error: float

    @property
    def is_good(self) -> bool:
        """Whether the wheel reaches its speed and holds it."""
        return (
            math.isfinite(self.rise_time) and self.overshoot <= OVERSHOOT and abs(self.error) <= STEADY_ERROR
        )


def wheel_speeds(times: NDArray[np.float64], ticks: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the speeds (n - 1,) between the samples of a counter (n,), ticks/s; times in s."""
    speeds: NDArray[np.float64] = np.diff(ticks) / np.diff(times)
    return speeds


def step_response(times: NDArray[np.float64], speeds: NDArray[np.float64], target: float) -> StepResponse:
    """Return the response to a step to `target` at time 0; times (n,) s and speeds (n,) in the unit of target."""
    # A mean over three samples: one tick more or less is a large share of a slow speed
    smooth = np.convolve(speeds, np.ones(3) / 3.0, mode="same") if len(speeds) >= 3 else speeds
    reached = np.flatnonzero(smooth >= 0.9 * target)
    rise_time = float(times[reached[0]]) if len(reached) else math.inf
    steady = float(speeds[2 * len(speeds) // 3 :].mean())
    return StepResponse(rise_time, max(0.0, float(smooth.max()) / target - 1.0), steady / target - 1.0)

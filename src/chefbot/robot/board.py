"""The motor board of the robot file: which one it is, where its pins are, what it does at rest."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.errors import name_hint
from chefbot.robot.section import RobotSection

BOARD_LOGIC = {"mega": 5.0, "tiva": 3.3, "pico": 3.3}
"""Voltage of the outputs of each kind of motor board, V."""
AT_REST = ("coast", "hold")
CLIFF_INPUTS = 4
FIXED_PINS = {0: "the serial line", 1: "the serial line", 4: "the IMU", 5: "the IMU", 26: "the battery"}
LAST_PIN = 22
"""A Pico has no terminals for the three pins behind it, and those behind these are its analogue inputs."""
PWM_CHANNELS = 16
"""Pins whose numbers differ by this have the same PWM channel."""
PWM_GROUPS = (("pwm_left", "pwm_right"), ("left_in_a", "left_in_b", "right_in_a", "right_in_b"))
"""Signals that need PWM channels of their own: with one PWM a motor, with two."""
Pin = Annotated[int, Meta(ge=0, le=28)]


class PicoPins(RobotSection, frozen=True, kw_only=True):
    """GP numbers of a Pico's signals that may be moved."""

    left_a: Pin = 6
    left_b: Pin = 7
    right_a: Pin = 8
    right_b: Pin = 9
    left_in_a: Pin = 10
    left_in_b: Pin = 11
    right_in_a: Pin = 12
    right_in_b: Pin = 13
    enable: Pin = 14
    estop: Pin = 15
    pwm_left: Pin = 16
    pwm_right: Pin = 17
    trigger: Pin = 2
    echo: Pin = 3
    cliff_0: Pin = 18
    """The first cliff sensor; the others are on the pins behind it."""

    def by_name(self) -> dict[str, int]:
        """Return the pins of all signals."""
        return msgspec.structs.asdict(self)

    def moved(self) -> dict[str, int]:
        """Return the pins that are not the usual ones."""
        usual = PicoPins().by_name()
        return {name: pin for name, pin in self.by_name().items() if pin != usual[name]}


class MotorBoard(RobotSection, frozen=True, kw_only=True):
    """The motor board, which counts the encoders and drives the motors."""

    kind: str = ""
    """One of BOARD_LOGIC; empty: not decided yet."""
    at_rest: str = AT_REST[0]
    """One of AT_REST: a second after a stop the wheels turn freely, or the motors stay shorted, as on a ramp."""
    pins: PicoPins = PicoPins()

    @property
    def logic(self) -> float:
        """Voltage of its outputs, V; the lowest of all boards if it is not decided yet."""
        return BOARD_LOGIC.get(self.kind, min(BOARD_LOGIC.values()))


def board_problems(board: MotorBoard, unused: Collection[str]) -> Iterator[tuple[bool, str, str]]:
    """Yield contradictions of the section: whether there is one, its key and the reason.

    unused: signals that the robot has no use for, whose pins are free for others.
    """
    unknown = f"unknown {board.kind!r}{name_hint(board.kind, BOARD_LOGIC)}"
    yield board.kind not in ("", *BOARD_LOGIC), "board.kind", unknown
    unknown = f"unknown {board.at_rest!r}{name_hint(board.at_rest, AT_REST)}"
    yield board.at_rest not in AT_REST, "board.at_rest", unknown
    moved = board.pins.moved()
    fixed = (
        "only those of a Pico can be moved; those of the other boards are where their timers and encoders are"
    )
    yield bool(moved) and board.kind != "pico", "board.pins", fixed
    pins = {name: pin for name, pin in board.pins.by_name().items() if name in moved or name not in unused}
    for name in moved:
        reason = _pin_problem(name, pins)
        yield bool(reason), f"board.pins.{name}", reason


def _pin_problem(name: str, pins: dict[str, int]) -> str:
    """Return why a signal of the Pico cannot be where it is; empty if it can."""
    own, signals = _pins_of(name, pins[name]), _signals(pins)
    for pin in own:
        others = [signal for signal in signals[pin] if signal != name]
        if others:
            return f"GP{pin} is taken by {others[0]}"
    if max(own) > LAST_PIN:
        return f"GP{max(own)} is not free; use pins up to GP{LAST_PIN}"
    if name in ("left_a", "right_a") and pins[f"{name[:-1]}b"] != pins[name] + 1:
        return f"the pin behind it, GP{pins[name] + 1}, must be {name[:-1]}b"
    return _channel_problem(name, pins)


def _channel_problem(name: str, pins: dict[str, int]) -> str:
    for group in PWM_GROUPS:
        same = [
            other
            for other in group
            if other in pins and other != name and (pins[other] - pins[name]) % PWM_CHANNELS == 0
        ]
        if name in group and same:
            return f"GP{pins[name]} has the same PWM channel as {same[0]} on GP{pins[same[0]]}"
    return ""


def _pins_of(name: str, pin: int) -> range:
    return range(pin, pin + (CLIFF_INPUTS if name == "cliff_0" else 1))


def _signals(pins: dict[str, int]) -> dict[int, list[str]]:
    """Return the signals at each pin that has one."""
    signals = {pin: [name] for pin, name in FIXED_PINS.items()}
    for name, first in pins.items():
        for pin in _pins_of(name, first):
            signals.setdefault(pin, []).append(name)
    return signals

"""What the links of all motor drives have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod

from chefbot.board.command_gate import NEVER_NS, CommandGate
from chefbot.board.drives.half_duplex import Answer, HalfDuplexLine, LineRequest
from chefbot.maths.counter_unwrap import wrap_signed
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus, KeyValue
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

MAX_UNATTENDED_SPEED = 0.15
"""Maximum speed of a wheel at the ground, m/s, whose drive keeps turning when this computer fails."""
SILENCE_NS = 300_000_000
"""Time without ticks after which the motion of the wheels is unknown, and they are stopped, ns."""


class DriveLink(ABC):
    """Base of the `MotorBoardLink` of a motor drive: one request after the other, as the subclass chooses them."""

    title = "motor drive"

    def __init__(self, robot: Robot) -> None:
        self.robot, self.line = robot, HalfDuplexLine()
        self.gate = CommandGate(MAX_UNATTENDED_SPEED / robot.wheel_radius)
        self._refused: str | None = None
        self.connection_lost()

    def connection_lost(self) -> None:
        """Reset the link after the serial connection was lost; an emergency stop stays latched."""
        self.line.clear()
        self.gate.reset()
        self._ticks_ns = NEVER_NS
        self._counts: tuple[int, int] | None = None
        self._ticks = (0, 0)

    @abstractmethod
    def next_request(self, now_ns: int) -> LineRequest | None:
        """Return the request that is due now."""

    @abstractmethod
    def process(self, answer: Answer) -> list[Message]:
        """Return the sensor messages in an answer."""

    @property
    @abstractmethod
    def problems(self) -> list[str]:
        """Why the drive has switched its motors off: sentences."""

    @property
    def details(self) -> dict[str, str]:
        """What else is known about the drive, for its diagnostics."""
        return {}

    # -- the interface of a motor board

    @property
    def refused(self) -> str | None:
        """Why the drive may not be used with this robot, None if it may."""
        return self._refused

    @property
    def notice(self) -> str | None:
        """A warning for the operator, None if there is none."""
        return None

    @property
    def is_open(self) -> bool:
        """Whether ticks have been received since the connection was opened."""
        return self._counts is not None

    @property
    def fault(self) -> str:
        """Why the motors are off; empty if they are not."""
        return " ".join(self.problems)

    def receive_data(self, data: bytes, now_ns: int) -> list[Message]:
        """Process received bytes and return the sensor messages in them."""
        answer = self.line.receive(data, now_ns)
        return [] if answer is None else self.process(answer)

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the next request if the line is free; call it after each reception, too."""
        request = self.next_request(now_ns) if self.line.is_free(now_ns) else None
        return b"" if request is None else self.line.send(request, now_ns)

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Set the angular velocities of the wheels, rad/s; they are sent with the next request."""
        self.gate.command(left, right, now_ns)
        return self.data_to_send(now_ns)

    def stop(self, now_ns: int) -> bytes:
        """Latch the emergency stop: speeds of zero are sent until it is cleared."""
        self.gate.stop()
        return self.data_to_send(now_ns)

    def clear(self, now_ns: int) -> None:  # noqa: ARG002 (interface)
        """Release the emergency stop; the robot drives after a stop was commanded once."""
        self.gate.clear()

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """Return the diagnostics of drive and link."""
        sentences = list(self.problems)
        if now_ns - self._ticks_ns > SILENCE_NS:
            sentences.append(f"The {self.title} does not answer.")
        level = ERROR if sentences else OK
        if self.notice is not None:
            level, sentences = max(level, WARN), [*sentences, f"{self.notice[0].upper()}{self.notice[1:]}."]
        values = self.details | {
            "lost answers": str(self.line.lost),
            "damaged answers": str(self.line.damaged),
        }
        pairs = tuple(KeyValue(key, value) for key, value in values.items())
        return DiagnosticStatus(
            level, "board", " ".join(sentences) or f"The {self.title} is OK.", port, pairs
        )

    # -- for subclasses

    def speeds(self, now_ns: int) -> tuple[float, float]:
        """Return the angular velocities to drive with, rad/s; without recent ticks the wheels stand."""
        recent = now_ns - self._ticks_ns < SILENCE_NS
        return self.gate.speeds(now_ns) if recent else (0.0, 0.0)

    def ticks(self, counts: tuple[int, int], bits: int, per_count: float, stamp_ns: int) -> list[Message]:
        """Return the message of both encoders' counters of so many bits; per_count: ticks of the robot file.

        Counters that have begun again at zero continue where they were.
        """
        previous, self._counts = self._counts, counts
        if previous is not None:
            left, right = (wrap_signed(now - old, bits) for now, old in zip(counts, previous, strict=True))
            fastest = 1.5 * self.robot.motor.no_load_tick_rate / per_count
            seconds = max(stamp_ns - self._ticks_ns, 0) / 1e9
            # More than the motors can turn: the drive has restarted
            if max(abs(left), abs(right)) <= fastest * seconds + 1.0:
                self._ticks = (self._ticks[0] + left, self._ticks[1] + right)
        self._ticks_ns = stamp_ns
        left_ticks, right_ticks = (round(per_count * count) for count in self._ticks)
        return [WheelTicks(Header.of(stamp_ns, "base_link"), left_ticks, right_ticks)]

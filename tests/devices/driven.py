"""The real driver on a real clock, commanded and watched by a test."""

from __future__ import annotations

import time
from collections.abc import Callable

from tests.devices.emulated import Cable
from tests.support.waiting import PATIENCE

from chefbot.board.link_health import NEUTRAL_REQUIRED
from chefbot.board.messages import MotionLine, StatusLine
from chefbot.board.status_codes import LATCHED, BoardFlag
from chefbot.devices.motor_board import BoardParams, MotorBoardDevice
from chefbot.msgs.chefbot_msgs import WheelSpeeds, WheelTicks
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import DEVICE, Loop
from chefbot.runtime.node import Context
from chefbot.runtime.transform_buffer import TransformBuffer

PERIOD_NS = 50_000_000


class Driven:
    """A board device on a real clock, commanded as the base node does it: 20 times a second, zeros too."""

    def __init__(self, port: str, robot: str | Robot = "chefbot") -> None:
        self.loop = Loop(WallClock(), time.time_ns())
        self.received: dict[str, list[Message]] = {}
        self.speed: float | None = 0.0
        """m/s of both wheels; None: upstream is dead."""
        self.turn = 0.0
        """m/s that the right wheel is faster by than the mean, and the left one slower."""
        self.stamp_age_ns = 0
        self._robot = load_robot(robot) if isinstance(robot, str) else robot
        self.loop.add_observer(lambda one: self.received.setdefault(one.topic, []).append(one.message))
        context = Context("board", self.loop, self._robot, TransformBuffer())
        self.device = MotorBoardDevice(context, BoardParams(port=port))
        self.device.start()
        self._command()

    def __enter__(self) -> Driven:
        return self

    def __exit__(self, *_: object) -> None:
        self.device.stop()

    def _command(self) -> None:
        now = self.loop.now_ns
        if self.speed is not None:
            header = Header.of(now - self.stamp_age_ns, "base_link")
            radius = self._robot.wheel_radius
            left, right = (self.speed - self.turn) / radius, (self.speed + self.turn) / radius
            self.loop.publish("wheel_speeds", WheelSpeeds(header, left, right), "base")
        self.loop.schedule(now + PERIOD_NS, DEVICE, self._command)

    def until(self, condition: Callable[[], bool], what: str) -> None:
        limit = time.monotonic() + PATIENCE
        self.loop.run(until=lambda: condition() or time.monotonic() > limit)
        assert condition(), f"waited {PATIENCE} s for {what}: {self.health}"

    def rest(self) -> None:
        """Command a stop a few times."""
        self.speed = 0.0
        count = len(self.received["wheel_speeds"]) + 3
        self.until(lambda: len(self.received["wheel_speeds"]) >= count, "commands")

    def press(self, stop: bool) -> None:
        self.loop.publish("emergency_stop", Bool(stop), "page")

    @property
    def health(self) -> str:
        arrays = self.received.get("diagnostics", [])
        return arrays[-1].status[0].message if arrays and isinstance(arrays[-1], DiagnosticArray) else ""

    @property
    def fault(self) -> str:
        """For which the board has switched its motors off, as published last."""
        faults = self.received.get("board_fault", [])
        return faults[-1].data if faults and isinstance(faults[-1], String) else ""

    @property
    def ticks(self) -> int:
        ticks = self.received.get("wheel_ticks", [])
        return ticks[-1].left if ticks and isinstance(ticks[-1], WheelTicks) else 0


def set_speed(cable: Cable) -> int:
    status = cable.newest(StatusLine)
    return status.set_left if isinstance(status, StatusLine) else 0


def standing(cable: Cable, since: int, lines: int = 5) -> bool:
    """So many status lines in a row, none before `since`, with no speed in force and no duty."""
    last = cable.since(since, StatusLine)[-lines:]
    return len(last) == lines and all(
        isinstance(line, StatusLine)
        and line.set_left == line.set_right == line.duty_left == line.duty_right == 0
        for line in last
    )


def drive(driven: Driven, cable: Cable, speed: float = 0.2) -> int:
    """Until the wheels hold the speed; gives the ticks/s."""
    wanted = round(speed / load_robot("chefbot").metres_per_tick)
    driven.speed = 0.0
    driven.until(lambda: ready(cable), "the board to be ready")
    driven.rest()
    push(driven, cable, speed, lambda: set_speed(cable) == wanted)
    return wanted


def push(driven: Driven, cable: Cable, speed: float, reached: Callable[[], bool]) -> None:
    """As a person does: lets go where board or driver ask for it, as they do after a pause of a busy computer."""

    def trying() -> bool:
        motion = cable.newest(MotionLine)
        waits = isinstance(motion, MotionLine) and motion.flags & BoardFlag.NEUTRAL_FIRST
        driven.speed = 0.0 if waits or NEUTRAL_REQUIRED[1:] in driven.health else speed
        return reached()

    driven.until(trying, f"{speed} m/s")


def clear_faults(driven: Driven, cable: Cable) -> None:
    """STOP pressed and let go; again where a clear came before the board knew that the cause is gone."""

    def latched() -> bool:
        motion = cable.newest(MotionLine)
        return isinstance(motion, MotionLine) and bool(motion.flags & LATCHED)

    for _ in range(10):
        driven.press(True)
        driven.press(False)
        enough = len(cable.lines) + 500
        driven.until(lambda: not latched() or len(cable.lines) > enough, "the board's lines")  # noqa: B023
        if not latched():
            return
    raise AssertionError(f"it stays latched: {driven.health}")


def ready(cable: Cable) -> bool:
    motion = cable.newest(MotionLine)
    return isinstance(motion, MotionLine) and not motion.flags & (
        BoardFlag.NO_SESSION | BoardFlag.NEUTRAL_FIRST | BoardFlag.NO_SPEED
    )

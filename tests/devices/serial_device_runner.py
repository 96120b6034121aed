"""Runs the driver of a serial sensor on a real clock, and keeps what it publishes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import msgspec
from tests.support.waiting import PATIENCE

from chefbot.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Context, Device
from chefbot.runtime.transform_buffer import TransformBuffer

M = TypeVar("M", bound=Message)


class SerialDeviceRunner:
    """The device of a robot; started on entry, stopped at the end."""

    def __init__(self, kind: type[Device], params: msgspec.Struct, robot: Robot) -> None:
        self.loop = Loop(WallClock(), time.time_ns())
        self.messages: dict[str, list[Message]] = {}
        self.loop.add_observer(lambda one: self.messages.setdefault(one.topic, []).append(one.message))
        self.device = kind(Context("sensor", self.loop, robot, TransformBuffer()), params)
        self.device.start()

    def __enter__(self) -> SerialDeviceRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.device.stop()

    def until(self, condition: Callable[[], bool], what: str) -> None:
        limit = time.monotonic() + PATIENCE
        self.loop.run(until=lambda: condition() or time.monotonic() > limit)
        assert condition(), f"waited {PATIENCE} s for {what}: {self.health}"

    def received(self, topic: str, kind: type[M]) -> list[M]:
        """The messages of a topic so far."""
        return [one for one in self.messages.get(topic, []) if isinstance(one, kind)]

    @property
    def health(self) -> DiagnosticStatus:
        arrays = self.received("diagnostics", DiagnosticArray)
        return arrays[-1].status[0] if arrays else DiagnosticStatus()

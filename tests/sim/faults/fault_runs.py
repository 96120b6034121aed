"""Runs of a simulated robot with fault events, with all publications kept."""

from __future__ import annotations

from typing import Any

import msgspec

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Device, Out, every
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.faults.events import FaultEvent
from chefbot.sim.faults.node_faults import inject
from chefbot.sim.simulation import Simulation

ROBOT = load_robot("chefbot_lidar")
SIMULATOR = "chefbot.sim.device:SimulatorDevice"
SPEED = 3.0
"""Wheel speed of a driving robot, rad/s."""


class DriverParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the driver: speed of the left wheel as a share of the right one's."""

    left: float = 1.0


class DriverDevice(Device):
    """Commands a zero speed, then constant speeds of the wheels."""

    params: DriverParams
    wheel_speeds: Out[WheelSpeeds]

    @every(hz=20)
    def drive(self) -> None:
        speed = SPEED if self.now_ns > 200_000_000 else 0.0
        self.wheel_speeds.publish(WheelSpeeds(left=self.params.left * speed, right=speed))


class FaultRun:
    """A simulated robot that stands or drives straight ahead while faults begin and end."""

    def __init__(
        self, *events: FaultEvent, drives: bool = False, left: float = 1.0, seed: int = 1, **params: Any
    ) -> None:
        self.system = NodeContainer(Loop(StepClock()), ROBOT, seed)
        self.loop = self.system.loop
        self.published: list[Publication] = []
        self.loop.add_observer(self.published.append)
        params = {"world": "empty", "profile": "perfect", "people": 0, "picture_hz": 0, **params}
        nodes = {"simulator": NodeEntry(kind=SIMULATOR, params=params)}
        if drives:
            nodes["driver"] = NodeEntry(
                kind="tests.sim.faults.fault_runs:DriverDevice", params={"left": left}
            )
        self.system.launch(inject(Launch(name="faulty", description="", args={}, nodes=nodes), events))
        simulator: Any = self.system.nodes["simulator"]
        self.simulation: Simulation = simulator.simulation
        self.board: Any = simulator._board

    def run(self, until: float) -> FaultRun:
        """Run until a time, s, and return the run."""
        self.loop.run(until_ns=round(until * 1e9))
        return self

    def close(self) -> None:
        self.system.stop()

    def on(self, topic: str, begin: float = 0.0, end: float = 1e9) -> list[Any]:
        """Return the messages published on a topic in [begin, end), s."""
        return [
            item.message
            for item in self.published
            if item.topic == topic and begin * 1e9 <= item.time_ns < end * 1e9
        ]

    def bytes_of(self, begin: float = 0.0, end: float = 1e9, *without: str) -> dict[str, list[bytes]]:
        """Return the bytes of each topic's messages published in [begin, end), s."""
        found: dict[str, list[bytes]] = {}
        for item in self.published:
            if begin * 1e9 <= item.time_ns < end * 1e9 and item.topic not in ("chefbot/launch", *without):
                found.setdefault(item.topic, []).append(item.message.to_cdr())
        return found

    @property
    def notices(self) -> list[tuple[float, str]]:
        """Time, s, and text of each notice."""
        return [
            (item.time_ns / 1e9, item.message.data)  # type: ignore[attr-defined]
            for item in self.published
            if item.topic == "simulation/notice"
        ]

    @property
    def pose(self) -> SE2:
        return self.simulation.truth().pose

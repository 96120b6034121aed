"""The hardware of a robot in a simulated world, at pseudo-terminals: a motor board and a lidar, in real time.

What drives it knows the ports alone, as on a built robot.
"""

from __future__ import annotations

import json
import select
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import wall_ns
from chefbot.sim.firmware import CONTROL_NS
from chefbot.sim.lidar import RotatingLidar
from chefbot.sim.lidar_line import EmulatedLidar
from chefbot.sim.motor_board import SimulatedMotorBoard
from chefbot.sim.ports.boot_loader import BoardWithBootLoader
from chefbot.sim.ports.pseudo_terminal import PseudoTerminal
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import load_any_world

MAX_LAG_NS = 50_000_000
"""Time by which the hardware may be behind the wall clock before its own time is slowed down, ns."""
TRUTH_PERIOD_NS = 100_000_000
"""Period of the lines about the true state, ns."""


class HardwareOptions(NamedTuple):
    """What hardware is emulated: robot, world, imperfections, people, and the paths of the ports."""

    robot: Robot
    world: str
    profile: str
    seed: int
    board: Path
    lidar: Path
    people: int = 0
    start: str = ""


class TrueState(NamedTuple):
    """What no sensor measures: time, s, pose of the robot from its start (x, y, yaw), and its collisions."""

    time: float
    pose: tuple[float, float, float]
    collisions: int
    touched: str

    def line(self) -> str:
        """Return the state as a line of JSON."""
        return json.dumps(self._asdict())


class EmulatedHardware:
    """The physics with a motor board and a lidar; `step` runs 10 ms of it."""

    def __init__(self, options: HardwareOptions) -> None:
        robot, lidar = options.robot, options.robot.sensors.lidar
        if lidar is None or not lidar.driver:
            raise UserError(f"robot {robot.name} has no lidar with a driver (sensors.lidar.driver)")
        world = load_any_world(options.world, robot, options.start)
        profile, people = options.profile, options.people
        self._simulation = Simulation(robot, world, profile, options.seed, people=people)  # type: ignore[arg-type]
        self._start = self._simulation.truth().pose
        board = SimulatedMotorBoard(robot, self._simulation)
        self._board, self._motors = BoardWithBootLoader(board, 0), board
        self._rotating = RotatingLidar(self._simulation, 0)
        self._lidar = EmulatedLidar(lidar.driver, self._rotating, 0)
        self.ports = {"board": PseudoTerminal(options.board), "lidar": PseudoTerminal(options.lidar)}
        self._paths = {"board": options.board, "lidar": options.lidar}

    @property
    def now_ns(self) -> int:
        """Time of the physics, ns."""
        return self._simulation.time_ns

    def step(self) -> None:
        """Run one control step of the board and what the lidar measures in it; exchange bytes with the ports."""
        now_ns = self.now_ns
        port = self.ports.get("board")
        if port is not None:
            if port.take_opening():
                self._board.reset(now_ns)
            self._board.write(port.read(), now_ns)
        self._motors.run_until(now_ns + CONTROL_NS)
        sent = self._board.read(self.now_ns)
        if port is not None:
            port.write(sent)
        self._rotating.follow(self.now_ns)
        self._serve_lidar(self.ports.get("lidar"))

    def _serve_lidar(self, port: PseudoTerminal | None) -> None:
        if port is not None:
            port.take_opening()
            self._lidar.receive(port.read(), self.now_ns)
        for _, data in self._lidar.bytes_until(self.now_ns):
            if port is not None:
                port.write(data)

    def unplug(self, device: str) -> None:
        """Pull the cable of the board or the lidar out."""
        if device in self.ports:
            self.ports.pop(device).close()

    def plug(self, device: str) -> None:
        """Plug a cable in again; the port is another one, linked at the same path."""
        if device not in self.ports:
            self.ports[device] = PseudoTerminal(self._paths[device])

    def truth(self) -> TrueState:
        """Return the simulated time, the true pose relative to the start, and the collisions so far."""
        collisions = self._simulation.collisions()
        x, y, yaw = self._start.between(self._simulation.truth().pose)
        return TrueState(self.now_ns / 1e9, (x, y, yaw), collisions.episodes, ", ".join(collisions.names))

    def close(self) -> None:
        """Unplug board and lidar: both ports disappear."""
        for device in list(self.ports):
            self.unplug(device)


def run_hardware(options: HardwareOptions, ended: threading.Event, publish: Callable[[str], None]) -> None:
    """Run the hardware in real time until `ended`; slower if the computer is. Lines of standard input unplug devices.

    publish: called with each line about the true state.
    """
    hardware = EmulatedHardware(options)
    try:
        began_ns, published_ns = wall_ns(), 0
        while not ended.is_set():
            hardware.step()
            if hardware.now_ns - published_ns >= TRUTH_PERIOD_NS:
                published_ns = hardware.now_ns
                publish(hardware.truth().line())
                _take_request(hardware, ended)
            ahead_ns = began_ns + hardware.now_ns - wall_ns()
            began_ns += max(0, -ahead_ns - MAX_LAG_NS)
            time.sleep(max(0.0, ahead_ns / 1e9))
    finally:
        hardware.close()


def _take_request(hardware: EmulatedHardware, ended: threading.Event) -> None:
    """Take a line `unplug DEVICE` or `plug DEVICE` from standard input; its end ends the hardware."""
    if not select.select([sys.stdin], [], [], 0.0)[0]:
        return
    line = sys.stdin.readline()
    verb, _, device = line.strip().partition(" ")
    if not line:
        ended.set()
    elif verb == "unplug":
        hardware.unplug(device)
    elif verb == "plug" and device in ("board", "lidar"):
        hardware.plug(device)

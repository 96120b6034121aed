"""Injects faults into the simulated robot: at its topics, in the physics, and at the board's pins and bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.random import default_rng

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.robot.spec import Robot
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.faults.events import (
    BitErrors,
    BoardUnplugged,
    Bump,
    Carried,
    ClockJump,
    InjectedFault,
    SensorFault,
    SensorOffset,
    SensorUpsideDown,
    SimulatorFault,
    VoltageDrop,
    WheelSlip,
    WheelStall,
    WrongVoltageReading,
)
from chefbot.sim.faults.schedule import FaultSchedule, describe, to_ns
from chefbot.sim.faults.topic_sensors import FaultySensor
from chefbot.sim.faults.wheels import SIDES
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.floor_plan import reachable

FREE = 0
CARRY_ATTEMPTS = 100
"""Drawn poses that are tried, as people and dropped boxes may stand there."""
_SEED_SALT = 0xCA881ED


class SimulatedRobotFaults:
    """The active faults of one simulated robot.

    Whenever a fault begins or ends, all injectors are set from the list of active ones, so that nothing remains
    of a fault that has ended.
    """

    def __init__(
        self,
        events: Iterable[SimulatorFault],
        simulation: Simulation,
        board: SimulatedBoard,
        lidar: FaultySensor[LaserScan],
        camera: FaultySensor[Image],
        notice: Callable[[str], None],
    ) -> None:
        self._simulation, self._board, self._lidar, self._camera = simulation, board, lidar, camera
        self._as_built = simulation.as_built
        self._rng = default_rng([simulation.seed, _SEED_SALT])
        events = tuple(events)
        for event in events:
            check_robot_has(simulation.robot, event)
        self.schedule = FaultSchedule[SimulatorFault](events, self._begin, lambda _: self._apply(), notice)

    def _begin(self, event: SimulatorFault) -> None:
        check_robot_has(self._simulation.robot, event)
        if isinstance(event, Bump):
            yaw = self._simulation.truth().pose.yaw
            self._simulation.wheel_faults.shove(event.impulse, yaw + event.direction)
        elif isinstance(event, Carried):
            self._carry(event)
        else:
            self._apply()

    def _carry(self, event: Carried) -> None:
        if event.to is not None:
            self._simulation.kidnap(SE2(*event.to))
            return
        plan = reachable(self._simulation.world, self._simulation.robot)
        cells = np.argwhere(plan.cells == FREE)
        for _ in range(CARRY_ATTEMPTS):
            row, column = cells[self._rng.integers(len(cells))].tolist()
            x = plan.origin_x + (column + 0.5) * plan.resolution
            y = plan.origin_y + (row + 0.5) * plan.resolution
            try:
                self._simulation.kidnap(SE2(x, y, float(self._rng.uniform(-math.pi, math.pi))))
            except UserError:
                continue
            return
        raise UserError("there is no free floor to set the robot down")

    def _active(self, kind: Any) -> list[Any]:
        return [event for event in self.schedule.active if isinstance(event, kind)]

    def _apply(self) -> None:
        self._apply_to_sensors()
        self._apply_to_mounts()
        self._apply_to_wheels()
        self._apply_to_board()
        jumps = dict.fromkeys(("board", "lidar", "depth_camera"), 0)
        for event in self._active(ClockJump):
            jumps[event.clock] += to_ns(event.seconds)
        self._board.clock_jump_ns = jumps["board"]
        self._lidar.clock_jump_ns, self._camera.clock_jump_ns = jumps["lidar"], jumps["depth_camera"]

    def _apply_to_sensors(self) -> None:
        board = self._board.motors.faults
        self._lidar.faults, self._camera.faults = self._of("lidar"), self._of("depth_camera")
        if board.ultrasonic.faults != self._of("ultrasonic"):
            board.ultrasonic.set_faults(self._of("ultrasonic"))
        if board.imu.faults != self._of("imu"):
            board.imu.set_faults(self._of("imu"))
        self._board.motors.firmware.set_imu_answers(not board.imu.stopped)
        board.encoders.faults = self._of("wheel_encoders")

    def _of(self, sensor: str) -> tuple[SensorFault, ...]:
        return tuple(event for event in self._active(SensorFault) if event.sensor == sensor)

    def _apply_to_mounts(self) -> None:
        """Turn the mounts; of several faults of one sensor the angles add up."""
        yaw = {"lidar": self._as_built.lidar_yaw, "depth_camera": self._as_built.camera_yaw}
        for event in self._active(SensorOffset):
            if event.sensor in yaw:
                yaw[event.sensor] += event.yaw
        upside_down = {event.sensor for event in self._active(SensorUpsideDown)}
        as_built = self._as_built._replace(
            lidar_yaw=yaw["lidar"],
            camera_yaw=yaw["depth_camera"],
            lidar_upside_down="lidar" in upside_down,
            camera_upside_down="depth_camera" in upside_down,
        )
        if as_built != self._simulation.as_built:
            self._simulation.remount(as_built)

    def _apply_to_wheels(self) -> None:
        slips, stalls = self._active(WheelSlip), self._active(WheelStall)
        left, right = (math.prod(e.share for e in slips if e.wheel in (side, "both")) for side in SIDES)
        self._simulation.wheel_faults.slip((float(left), float(right)))
        left, right = (any(e.wheel in (side, "both") for e in stalls) for side in SIDES)
        self._simulation.wheel_faults.stall((left, right))

    def _apply_to_board(self) -> None:
        board = self._board.motors.faults
        self._simulation.battery.voltage_share = math.prod(e.share for e in self._active(VoltageDrop))
        wrong = self._active(WrongVoltageReading)
        board.wrong_voltage_reading = wrong[-1].voltage if wrong else None
        board.serial_link.unplugged = bool(self._active(BoardUnplugged))
        board.serial_link.bit_errors = max((e.rate for e in self._active(BitErrors)), default=0.0)


def check_robot_has(robot: Robot, event: InjectedFault) -> None:
    """Raise UserError if the robot has no such sensor."""
    part = getattr(event, "sensor", getattr(event, "clock", ""))
    optional = {name: getattr(robot.sensors, name) for name in ("lidar", "depth_camera", "ultrasonic")}
    if part in optional and optional[part] is None:
        raise UserError(
            f"{describe(event)} is impossible: robot {robot.name} has no {part.replace('_', ' ')}"
        )

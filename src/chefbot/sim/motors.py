"""Model of the gear motors: back-EMF, torque, friction and current, from the motor's data sheet."""

from __future__ import annotations

from typing import Any, NamedTuple

from chefbot.robot.spec import DRIVE_EFFICIENCY, Robot

ALL_MOTORS = 1
"""Bit of `disableactuator` for group 0, which contains all of the robot's actuators."""


class Motors(NamedTuple):
    """A brushed DC motor with constant flux and resistance behind its gear, all at the gear's output shaft.

    Source: Hughes and Drury, Electric Motors and Drives, ch. 3. The no-load current overcomes the motor's own
    friction: T0 = k I0, k = Ts / (Is - I0). With the driver on, the windings give (Ts + T0) V / Vr - Ts n /
    n0, stall torque less back-EMF; at the rated voltage, less friction, that is the straight line between no
    load and stall. With the driver off, only the friction remains.
    """

    friction: float
    """Friction torque after the losses of wheel and bearing, N m."""
    torque_per_ampere: float
    """Torque constant after the losses of wheel and bearing, N m/A."""

    @staticmethod
    def of(robot: Robot) -> Motors:
        """Return the motor model of a robot, from its data sheet."""
        motor = robot.motor
        # Torque constant k = Ts / (Is - I0); friction T0 = k I0.
        torque_constant = (
            DRIVE_EFFICIENCY * motor.stall_torque / (motor.stall_current - motor.no_load_current)
        )
        return Motors(torque_constant * motor.no_load_current, torque_constant)

    def install(self, model: Any) -> None:
        """Add the motors' friction to a compiled model with linear actuators (chefbot.design.export.mjcf)."""
        for motor in range(model.nu):
            max_control = model.actuator_ctrlrange[motor, 1]
            # Torque at zero speed: Ts + T0, so that friction leaves Ts at the shaft.
            model.actuator_gainprm[motor, 0] += self.friction
            max_torque = max_control * model.actuator_gainprm[motor, 0]
            model.actuator_forcerange[motor] = (-max_torque, max_torque)
            wheel = model.jnt_dofadr[model.actuator_trnid[motor, 0]]
            # Dry friction T0 on the wheel joint.
            model.dof_frictionloss[wheel] += self.friction

    def currents(self, torques: tuple[float, float]) -> tuple[float, float]:
        """Return the winding currents, A, that give these motor torques, N m."""
        return torques[0] / self.torque_per_ampere, torques[1] / self.torque_per_ampere


def enable_drivers(model: Any, on: bool) -> None:
    """Switch the motor drivers: off opens the windings (wheels turn freely), on with duty 0 shorts them."""
    model.opt.disableactuator = 0 if on else ALL_MOTORS

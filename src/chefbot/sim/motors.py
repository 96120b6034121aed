"""The gear motors of the simulated robot: back-EMF, torque, friction and current, from the motor's data sheet."""

from __future__ import annotations

from typing import Any, NamedTuple

from chefbot.robot.spec import DRIVE_EFFICIENCY, Robot

ALL_MOTORS = 1
"""Bit of `disableactuator`: group 0, in which every actuator of the robot is."""


class Motors(NamedTuple):
    """A brushed motor with constant flux and resistance behind its gear (Hughes and Drury, Electric Motors and
    Drives, ch. 3), all at the gear's shaft.

    Its own friction is what the current without load turns against: T0 = k I0, k = Ts / (Is - I0). With the
    driver on, the windings give (Ts + T0) V / Vr - Ts n / n0; at the rated voltage less friction that is the
    straight line between no load and stall. With the driver off, only the friction is left.
    """

    friction: float
    """N m, after the losses of wheel and bearing."""
    torque_per_ampere: float
    """N m/A, after the losses of wheel and bearing."""

    @staticmethod
    def of(robot: Robot) -> Motors:
        """Of its data sheet."""
        motor = robot.motor
        constant = DRIVE_EFFICIENCY * motor.stall_torque / (motor.stall_current - motor.no_load_current)
        return Motors(constant * motor.no_load_current, constant)

    def install(self, model: Any) -> None:
        """Into a compiled model whose actuators are the straight line (chefbot.design.export.mjcf)."""
        for motor in range(model.nu):
            limit = model.actuator_ctrlrange[motor, 1]
            model.actuator_gainprm[motor, 0] += self.friction
            reach = limit * model.actuator_gainprm[motor, 0]
            model.actuator_forcerange[motor] = (-reach, reach)
            wheel = model.jnt_dofadr[model.actuator_trnid[motor, 0]]
            model.dof_frictionloss[wheel] += self.friction

    def currents(self, torques: tuple[float, float]) -> tuple[float, float]:
        """Ampere in the windings that give these torques, N m."""
        return torques[0] / self.torque_per_ampere, torques[1] / self.torque_per_ampere


def switch(model: Any, on: bool) -> None:
    """The drivers: off, the windings are open and the wheels turn freely; on with duty 0, they are shorted."""
    model.opt.disableactuator = 0 if on else ALL_MOTORS

"""A brushed motor as the straight line between no load and stall, at any voltage.

Speed n = n0 * V/Vr - T * n0/Ts and current I = I0 + (Is - I0) * T/Ts: constant flux, constant resistance,
no-load torque neglected (Hughes and Drury, Electric Motors and Drives, ch. 3).
"""

from __future__ import annotations

from chefbot.design.sizing.calculation import Result, calculated
from chefbot.robot.drivetrain import Motor

SOURCE = "straight motor line (Hughes and Drury, Electric Motors and Drives, ch. 3), data sheet"


def speed(motor: Motor, torque: float, voltage: float, name: str) -> Result:
    """Return the speed of the gear shaft under `torque` N m at `voltage`, rad/s; negative for an excessive load."""
    value = motor.no_load_speed * voltage / motor.voltage - torque * motor.speed_torque_gradient
    return calculated(
        name, value, "rad/s", "n0 * (V / Vr - T / Ts)", SOURCE,
        n0=motor.no_load_speed, V=voltage, Vr=motor.voltage, T=torque, Ts=motor.stall_torque,
    )  # fmt: skip


def current(motor: Motor, torque: float, name: str) -> Result:
    """Return the current of one motor at `torque` N m, A; independent of the voltage."""
    value = (
        motor.no_load_current + (motor.stall_current - motor.no_load_current) * torque / motor.stall_torque
    )
    return calculated(
        name, value, "A", "I0 + (Is - I0) * T / Ts", SOURCE,
        I0=motor.no_load_current, Is=motor.stall_current, T=torque, Ts=motor.stall_torque,
    )  # fmt: skip


def voltage(motor: Motor, torque: float, turning: float) -> Result:
    """Return the voltage of one motor at `turning` rad/s and `torque` N m, V."""
    value = motor.voltage * (turning / motor.no_load_speed + torque / motor.stall_torque)
    return calculated(
        "voltage across a cruising motor", value, "V", "Vr * (n / n0 + T / Ts)", SOURCE,
        Vr=motor.voltage, n=turning, n0=motor.no_load_speed, T=torque, Ts=motor.stall_torque,
    )  # fmt: skip


def stall_torque(motor: Motor, voltage: float) -> Result:
    """Return the stall torque at another voltage than the rated one, N m."""
    return calculated(
        "stall torque, empty battery", motor.stall_torque * voltage / motor.voltage, "N m", "Ts * V / Vr",
        SOURCE, Ts=motor.stall_torque, V=voltage, Vr=motor.voltage,
    )  # fmt: skip


def stall_current(motor: Motor, voltage: float) -> Result:
    """Return the stall current at another voltage than the rated one, A."""
    return calculated(
        "stall current, full battery", motor.stall_current * voltage / motor.voltage, "A", "Is * V / Vr",
        SOURCE, Is=motor.stall_current, V=voltage, Vr=motor.voltage,
    )  # fmt: skip

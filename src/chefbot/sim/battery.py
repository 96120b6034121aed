"""Battery model: charge drained by motors and electronics, and a terminal voltage that sags under load."""

from __future__ import annotations

from chefbot.battery.pack import resistance
from chefbot.robot.spec import Robot


class SimulatedBattery:
    """A battery with linear open-circuit voltage, from `battery.full_voltage` to `battery.empty_voltage`.

    charge: remaining charge, C. current: present current, A. voltage: terminal voltage, V; 0 when the pack is
    empty.
    """

    def __init__(self, robot: Robot) -> None:
        self._spec = robot.battery
        self._electronics = robot.power.electronics
        self._empty_voltage = robot.battery.empty_voltage
        self._voltage_range = robot.battery.full_voltage - robot.battery.empty_voltage
        self._motor_voltage = robot.motor.voltage
        self._resistance = resistance(robot)
        self.charge = robot.battery.capacity
        self.voltage_share = 1.0
        """Share of the voltage that a weak battery has left."""
        self.current = 0.0
        self.voltage = 0.0
        self.drain((0.0, 0.0), (0.0, 0.0), 0.0)

    @property
    def state_of_charge(self) -> float:
        """State of charge as a share of the capacity, 0..1."""
        return self.charge / self._spec.capacity

    @property
    def voltage_ratio(self) -> float:
        """Terminal voltage as a share of the motors' rated voltage."""
        return self.voltage / self._motor_voltage

    def drain(self, duties: tuple[float, float], currents: tuple[float, float], duration: float) -> None:
        """Draw the current of both motors (duty -1..1, winding current in A) and the electronics for
        `duration` s.

        A chopper with duty d draws d times the motor current from the pack. Braking motors do not recuperate.
        """
        if self.charge <= 0.0:
            self.charge = self.current = self.voltage = 0.0
            return
        # Chopper: I_pack = sum of d * I_motor, without recuperation.
        left, right = duties[0] * currents[0], duties[1] * currents[1]
        motor_current = (left if left > 0.0 else 0.0) + (right if right > 0.0 else 0.0)
        empty = self._empty_voltage
        self.current = motor_current + self._electronics / (self.voltage if self.voltage > empty else empty)
        # Coulomb counting.
        self.charge -= self.current * duration
        # Terminal voltage: V = V_oc(level) - R I.
        healthy = empty + self._voltage_range * self.state_of_charge - self._resistance * self.current
        self.voltage = self.voltage_share * healthy

"""The battery: charge that motors and electronics drain, and a voltage that sags under load."""

from __future__ import annotations

from chefbot.robot.spec import Robot

SAG_AT_ONE_HOUR_RATE = 0.04
"""Share of the voltage lost at the current that empties the pack in one hour (small lead or NiMH pack)."""


class Battery:
    """Open-circuit voltage falls in a line from `battery.full_voltage` to `battery.empty_voltage`.

    charge: coulombs left. current: ampere that flows now. voltage: volts at the terminals now. An empty pack
    gives 0 V.
    """

    def __init__(self, robot: Robot, level: float = 1.0) -> None:
        self._spec = robot.battery
        self._electronics = robot.power.electronics
        self._motor_voltage = robot.motor.voltage
        self._resistance = SAG_AT_ONE_HOUR_RATE * robot.battery.voltage / (robot.battery.capacity / 3600.0)
        self.charge = level * robot.battery.capacity
        self.current = 0.0
        self.voltage = 0.0
        self.drain((0.0, 0.0), (0.0, 0.0), 0.0)

    @property
    def level(self) -> float:
        """Share of the charge that is left, 0..1."""
        return self.charge / self._spec.capacity

    @property
    def drive(self) -> float:
        """The voltage that the motors get, as a share of the one that their data are for."""
        return self.voltage / self._motor_voltage

    def drain(self, duties: tuple[float, float], currents: tuple[float, float], duration: float) -> None:
        """Take what both motors (duty -1..1, ampere in the windings) and the electronics need for `duration` s.

        A chopper with duty d draws d times the motor's current from the pack. Braking motors give nothing back.
        """
        if self.charge <= 0.0:
            self.charge = self.current = self.voltage = 0.0
            return
        motors = sum(max(d * c, 0.0) for d, c in zip(duties, currents, strict=True))
        self.current = motors + self._electronics / max(self.voltage, self._spec.empty_voltage)
        self.charge -= self.current * duration
        span = self._spec.full_voltage - self._spec.empty_voltage
        self.voltage = self._spec.empty_voltage + span * self.level - self._resistance * self.current

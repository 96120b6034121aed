"""The battery pack of a robot file as its gauge knows it: voltage by charge and load."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.robot.spec import Robot

VOLTAGE_SAG_AT_1C = 0.04
"""Share of the voltage lost at the 1C current, which empties the pack in one hour (small lead or NiMH)."""


class BatteryPack(NamedTuple):
    """A pack whose open-circuit voltage falls linearly from full to empty.

    energy: usable energy of the new, warm pack, J. resistance: Ohm. voltages: V.
    """

    full_voltage: float
    empty_voltage: float
    nominal_voltage: float
    resistance: float
    energy: float

    @classmethod
    def of(cls, robot: Robot, energy: float) -> BatteryPack:
        """Return the pack of a robot with the usable energy (J) of its sizing."""
        battery = robot.battery
        return cls(battery.full_voltage, battery.empty_voltage, battery.voltage, resistance(robot), energy)

    def is_possible(self, voltage: float) -> bool:
        """Return whether a pack of a robot that still runs can have a voltage; a loose wire measures others."""
        return 0.5 * self.empty_voltage <= voltage <= 1.5 * self.full_voltage

    def charge_share(self, voltage: float, power: float, driving_power: float) -> float:
        """Return the charge, 0..1, above that at which the firmware stops the robot while it drives.

        voltage: at the terminals while `power` (W) is drawn. driving_power: W. The firmware compares the voltage
        under load, V = V_oc - R I, so a robot that stands has less left than its voltage shows.
        """
        under_load = voltage - self.resistance * (driving_power - power) / self.nominal_voltage
        share = (under_load - self.empty_voltage) / (self.full_voltage - self.empty_voltage)
        return min(1.0, max(0.0, share))


def resistance(robot: Robot) -> float:
    """Return the internal resistance of a new, warm pack, Ohm."""
    return VOLTAGE_SAG_AT_1C * robot.battery.voltage / (robot.battery.capacity / 3600.0)

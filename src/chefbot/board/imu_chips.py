"""IMUs with the registers that the motor board's firmware reads, by what they answer to WHO_AM_I.

The firmware tries any chip; one with other registers does not return its settings.
"""

from __future__ import annotations

IMU_CHIPS = {
    0x68: "MPU-6050",
    0x70: "MPU-6500",
    0x71: "MPU-9250",
    0x72: "MPU-6050 module with another chip of its family",
    0x73: "MPU-9255",
    0x74: "MPU-6515",
    0x12: "ICM-20602",
    0xAF: "ICM-20608",
    0x98: "ICM-20689, or an MPU-6050 module with it",
}


def chip_name(identity: int) -> str:
    """Return the name of the chip with an answer to WHO_AM_I, 0 for none."""
    if identity == 0:
        return "none answers"
    return f"{IMU_CHIPS.get(identity, 'unknown')} (id 0x{identity:02X})"


def imu_fault(identity: int) -> str:
    """Return why the board does not use its IMU."""
    if identity == 0:
        return "no IMU answers: check its wires and its supply"
    if identity not in IMU_CHIPS:
        return f"the IMU with the id 0x{identity:02X} has not the registers of an MPU-6050: use one, or a relative"
    return f"the IMU, {chip_name(identity)}, is stuck or saturated"

"""Names of the IMUs that the firmware reads, and why it does not use one."""

from __future__ import annotations

import pytest

from chefbot.board.imu_chips import IMU_CHIPS, chip_name, imu_fault


@pytest.mark.parametrize("identity", [*IMU_CHIPS, 0xEA])
def test_a_chip_is_named_with_its_id(identity: int) -> None:
    assert f"0x{identity:02X}" in chip_name(identity) and f"0x{identity:02X}" in imu_fault(identity)


def test_a_bus_without_a_chip_is_named() -> None:
    assert "none" in chip_name(0) and "wires" in imu_fault(0)

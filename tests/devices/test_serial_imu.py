"""The driver of IMUs with a line of their own, on a pseudo-terminal, and what the board's driver leaves to it."""

from __future__ import annotations

import os
import threading
import tty
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest
from tests.devices.serial_device_runner import SerialDeviceRunner

from chefbot.devices.serial_imu import SerialImuDevice, SerialImuParams
from chefbot.imu import bno085, witmotion
from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.sensor_msgs import Imu
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")
RATE = 0.5
"""Angular velocity of the emulated sensors, rad/s."""
UP = (0.0, 0.0, 9.80665)


def robot_with(driver: str) -> Robot:
    robot = load_robot("chefbot")
    imu = msgspec.structs.replace(robot.sensors.imu, driver=driver)
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, imu=imu))


class EmulatedImu:
    """An IMU at the far end of a pseudo-terminal that sends 100 samples a second."""

    def __init__(self, driver: str, link: Path) -> None:
        self._driver, self.silent, self.received = driver, False, b""
        self._ours, self._theirs = os.openpty()
        for end in (self._ours, self._theirs):
            tty.setraw(end)
        os.set_blocking(self._ours, False)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._theirs))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        self._ended.set()
        self._thread.join()
        os.close(self._theirs)
        os.close(self._ours)

    def _run(self) -> None:
        number = 0
        while not self._ended.wait(0.01):
            with suppress(BlockingIOError):
                self.received += os.read(self._ours, 100)
            if not self.silent:
                self._send(number)
            number += 1

    def _send(self, number: int) -> None:
        data = bno085.encode(number, RATE * 0.01 * number, UP)
        if self._driver != "bno085_rvc":
            packets = ((witmotion.ACCELERATION, UP), (witmotion.RATES, (0.0, 0.0, RATE)))
            data = b"".join(witmotion.encode(kind, values) for kind, values in packets)
        with suppress(BlockingIOError):  # what nobody reads is lost, as on a line
            os.write(self._ours, data)


class Driver(SerialDeviceRunner):
    """The IMU's driver."""

    def __init__(self, robot: Robot, port: Path) -> None:
        super().__init__(SerialImuDevice, SerialImuParams(port=str(port)), robot)

    @property
    def readings(self) -> list[Imu]:
        return self.received("imu/data", Imu)


@pytest.mark.parametrize("driver", ["bno085_rvc", "witmotion"])
def test_readings_have_rates_acceleration_and_rising_stamps(driver: str, tmp_path: Path) -> None:
    plugged = EmulatedImu(driver, tmp_path / "imu")
    with Driver(robot_with(driver), tmp_path / "imu") as robot:
        robot.until(lambda: len(robot.readings) > 30 and robot.health.level == OK, "readings")
    plugged.unplug()
    for reading in robot.readings:
        assert reading.angular_velocity.z == pytest.approx(RATE, abs=0.02)
        assert reading.linear_acceleration.z == pytest.approx(9.81, abs=0.02)
        assert reading.angular_velocity_covariance[8] > 0.0 and reading.header.frame_id == "imu_link"
    stamps = [reading.header.stamp.ns for reading in robot.readings]
    assert stamps == sorted(set(stamps))
    assert (
        plugged.received == b"" if driver == "bno085_rvc" else plugged.received.startswith(witmotion.UNLOCK)
    )


@pytest.mark.slow
def test_silence_and_a_pulled_cable_are_errors_until_it_is_back(tmp_path: Path) -> None:
    port = tmp_path / "imu"
    plugged = EmulatedImu("bno085_rvc", port)
    with Driver(robot_with("bno085_rvc"), port) as robot:
        robot.until(lambda: bool(robot.readings) and robot.health.level == OK, "readings")
        plugged.silent = True
        robot.until(lambda: "sent no sample" in robot.health.message, "the silence")
        plugged.unplug()
        robot.until(lambda: robot.health.level == ERROR and "sample" not in robot.health.message, "the loss")
        again, count = EmulatedImu("bno085_rvc", port), len(robot.readings)
        robot.until(lambda: robot.health.level == OK and len(robot.readings) > count, "readings again")
    again.unplug()


@pytest.mark.slow
def test_another_device_is_not_an_imu_and_gets_no_bytes(tmp_path: Path) -> None:
    plugged = EmulatedImu("bno085_rvc", tmp_path / "port")
    with Driver(robot_with("witmotion"), tmp_path / "port") as robot:
        robot.until(lambda: "not from a WitMotion" in robot.health.message, "the reason")
    plugged.unplug()
    assert plugged.received == b"" and not robot.readings


def test_an_imu_on_the_board_needs_no_driver(tmp_path: Path) -> None:
    with Driver(load_robot("chefbot"), tmp_path / "port") as robot:
        robot.device.publish_health()
    assert not robot.messages

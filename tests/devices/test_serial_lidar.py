"""The lidar driver on a pseudo-terminal: scans, silence, a cable that is pulled, and the end."""

from __future__ import annotations

import os
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
from tests.devices.emulated_lidar import PluggedLidar
from tests.devices.serial_device_runner import SerialDeviceRunner
from tests.lidar.wires import room
from tests.support.waiting import PATIENCE, wait_for

from chefbot.devices.serial_lidar import SerialLidarDevice, SerialLidarParams
from chefbot.lidar.emulators import RplidarEmulator
from chefbot.lidar.ydlidar import STOP
from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")


def robot_with(driver: str) -> Robot:
    """The robot whose lidar has a driver."""
    robot = load_robot("chefbot_lidar")
    assert robot.sensors.lidar is not None
    lidar = msgspec.structs.replace(robot.sensors.lidar, driver=driver)
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, lidar=lidar))


class Driver(SerialDeviceRunner):
    """The lidar's driver."""

    def __init__(self, driver: str, port: Path | str) -> None:
        super().__init__(SerialLidarDevice, SerialLidarParams(port=str(port)), robot_with(driver))

    @property
    def scans(self) -> list[LaserScan]:
        return self.received("scan", LaserScan)


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "lidar"


@pytest.mark.rotated
@pytest.mark.parametrize("driver", ["ld19", "rplidar_a1", "rplidar_c1", "ydlidar_x4", "ydlidar_x2"])
@pytest.mark.slow
def test_scans_of_the_room_arrive_with_recent_stamps(driver: str, port: Path) -> None:
    plugged = PluggedLidar(driver, port)
    with Driver(driver, port) as robot:
        robot.until(lambda: len(robot.scans) >= 5, "scans")
        robot.until(lambda: robot.health.level == OK, "good health")
        age = (time.time_ns() - robot.scans[-1].header.stamp.ns) / 1e9  # the loop's own time may be behind
    plugged.unplug()
    for scan in robot.scans[2:]:
        near = np.stack([room(scan.angles + d) for d in np.linspace(-0.03, 0.03, 21)])
        found = np.isfinite(scan.ranges)
        assert found.mean() > 0.7
        assert ((scan.ranges >= near.min(axis=0) - 0.02) & (scan.ranges <= near.max(axis=0) + 0.02))[
            found
        ].all()
    stamps = [scan.header.stamp.ns for scan in robot.scans]
    assert stamps == sorted(stamps) and 0.0 <= age < PATIENCE


@pytest.mark.slow
def test_a_silent_lidar_is_an_error_and_its_return_is_noticed(port: Path) -> None:
    plugged = PluggedLidar("ld19", port)
    with Driver("ld19", port) as robot:
        robot.until(lambda: len(robot.scans) >= 2 and robot.health.level == OK, "scans")
        plugged.silent = True
        robot.until(lambda: robot.health.level == ERROR, "an error")
        assert "no complete revolution" in robot.health.message
        plugged.silent, count = False, len(robot.scans)
        robot.until(lambda: robot.health.level == OK and len(robot.scans) > count + 1, "scans again")
    plugged.unplug()


@pytest.mark.slow
def test_a_lidar_is_found_again_at_another_port(port: Path) -> None:
    plugged = PluggedLidar("rplidar_c1", port)
    with Driver("rplidar_c1", port) as robot:
        robot.until(lambda: len(robot.scans) >= 2 and robot.health.level == OK, "scans")
        plugged.unplug()
        robot.until(lambda: robot.health.level == ERROR, "the loss")
        assert any("broke" in one.data for one in robot.messages["lidar/notice"] if isinstance(one, String))
        again = PluggedLidar("rplidar_c1", port)
        count = len(robot.scans)
        robot.until(lambda: robot.health.level == OK and len(robot.scans) > count + 1, "scans again")
    again.unplug()


@pytest.mark.parametrize("driver", ["rplidar_a1", "ydlidar_x4"])
@pytest.mark.slow
def test_the_lidar_is_stopped_at_the_end(driver: str, port: Path) -> None:
    plugged = PluggedLidar(driver, port)
    with Driver(driver, port) as robot:
        robot.until(lambda: len(robot.scans) >= 1, "a scan")
    wait_for(lambda: not plugged.lidar.scanning, "the lidar to stop")
    if isinstance(plugged.lidar, RplidarEmulator):
        wait_for(lambda: not plugged.lidar.motor, "its motor to stop")
    else:
        assert STOP in plugged.received
    plugged.unplug()


@pytest.mark.slow
def test_a_damaged_lidar_is_reported(port: Path) -> None:
    plugged = PluggedLidar("rplidar_c1", port)
    assert isinstance(plugged.lidar, RplidarEmulator)
    plugged.lidar.healthy = False
    with Driver("rplidar_c1", port) as robot:
        robot.until(lambda: "code 7" in robot.health.message, "the code")
        assert robot.health.level == ERROR and not robot.scans
    plugged.unplug()


@pytest.mark.slow
def test_a_port_without_a_lidar_is_named(port: Path) -> None:
    with Driver("ld19", port) as robot:
        robot.until(lambda: str(port) in robot.health.message, "the port's name")
        assert "plug the lidar in" in robot.health.message

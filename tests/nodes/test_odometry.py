"""Tests the diagnostics of the odometry node."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import DEVICE, Loop
from chefbot.runtime.node_container import NodeContainer

PERIOD = 20_000_000


def health(silent_from: float) -> list[tuple[int, str]]:
    """Return level and message of each second of a straight drive; the gyro is silent from `silent_from` s on."""
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot"), 1)
    entry = NodeEntry(kind="chefbot.nodes.odometry:OdometryNode")
    system.launch(Launch(name="test", description="", args={}, nodes={"odometry": entry}))
    statuses: list[tuple[int, str]] = []

    def keep(message: DiagnosticArray) -> None:
        statuses.append((message.status[0].level, message.status[0].message))

    def publish_sensors(i: int) -> None:
        header = Header.of(system.loop.now_ns, "base_link")
        if system.loop.now_ns < silent_from * 1e9:
            system.loop.publish("imu/data", Imu(header, angular_velocity=Vector3()), "test")
        system.loop.publish("wheel_ticks", WheelTicks(header, 50 * i, 50 * i), "test")

    system.loop.subscribe("diagnostics", "test", keep)
    for i in range(1, 200):
        system.loop.schedule(i * PERIOD, DEVICE, lambda i=i: publish_sensors(i))
    system.loop.run(until_ns=4_000_000_000)
    return statuses


def test_a_silent_gyro_is_reported() -> None:
    statuses = health(silent_from=1.9)
    assert [level for level, _ in statuses] == [OK, OK, WARN, WARN]
    assert "No gyro" in statuses[-1][1]


def test_a_healthy_robot_reports_ok() -> None:
    assert [level for level, _ in health(silent_from=9.0)] == [OK, OK, OK, OK]

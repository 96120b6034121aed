"""The battery in a launch: the monitor's node, deliveries that obey it, and the log on the disk."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from tests.planning.rooms import walled
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.devices.battery_log import LogFile
from chefbot.devices.state_files import read_state
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import BatteryLog, BatteryStatus, Errand, LocalizationStatus, Order
from chefbot.msgs.diagnostic_msgs import OK, WARN
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped, Twist
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.msgs.sensor_msgs import BatteryState
from chefbot.msgs.std_msgs import Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage

MONITOR = {"battery": "chefbot.nodes.battery_monitor:BatteryMonitorNode"}
DELIVERY = {
    "navigator": "tests.support.nodes:FakeNavigator",
    "delivery": "chefbot.nodes.delivery:DeliveryNode",
}
LOW, HIGH = ROBOT.battery.empty_voltage, ROBOT.battery.full_voltage


class Monitored(NodeRunner):
    """The monitor's node on a robot whose voltage the test gives."""

    def __init__(self, kinds: dict[str, str] | None = None, restored: dict[str, Any] | None = None) -> None:
        super().__init__(kinds or MONITOR, restored or {})

    def show(self, share: float, seconds: float = 60.0, speed: float = 0.0) -> BatteryStatus:
        """Show a voltage, as a share of its range, for a while."""
        for i in range(round(seconds * 2)):
            voltage = LOW + share * (HIGH - LOW) + 0.001 * (i % 2)
            stamp = Header.of(self.loop.now_ns, "odom")
            odom = Odometry(stamp, "base_link", twist=Odometry().twist.__class__(Twist.of(speed, 0.0)))
            self.loop.publish("odom", odom, "odometry", from_device=True)
            self.loop.publish("battery_state", BatteryState(voltage=voltage), "board", from_device=True)
            self.run(0.5)
        status: BatteryStatus = self.messages("battery_status")[-1]
        return status


def test_the_level_follows_the_voltage_and_is_a_warning() -> None:
    robot = Monitored()
    assert robot.show(0.95).level == "ok"
    robot.run(1.0)
    assert robot.messages("diagnostics")[-1].status[0].level == OK
    status = robot.show(0.1, 120.0)
    robot.run(1.0)
    health = robot.messages("diagnostics")[-1].status[0]
    assert status.level == "park" and health.level == WARN and health.message == status.description
    notices = [message.data for message in robot.messages("battery/notice")]
    assert notices and len(notices) <= 5, "one for each change"


def test_without_a_reading_it_publishes_nothing() -> None:
    robot = Monitored()
    robot.run(5.0)
    assert not robot.messages("battery_status") and not robot.messages("diagnostics")


@pytest.mark.parametrize("voltage", [float("nan"), float("inf"), -5.0, 0.0, 1e9])
def test_odd_voltages_end_in_no_exception(voltage: float) -> None:
    robot = Monitored()
    robot.show(0.9)
    for _ in range(20):
        robot.loop.publish("battery_state", BatteryState(voltage=voltage), "board", from_device=True)
        robot.run(0.5)
    status = robot.messages("battery_status")[-1]
    assert 0.0 <= status.charge <= 1.0 and status.energy >= 0.0


def test_the_distance_of_the_odometry_is_counted() -> None:
    robot = Monitored()
    robot.show(0.9, 60.0, speed=0.3)
    use = robot.system.nodes["battery"]._monitor._gauge.use
    assert use.distance == pytest.approx(18.0, abs=0.5) and use.moving == pytest.approx(60.0, abs=2.0)


def test_an_absurd_speed_does_not_empty_the_battery() -> None:
    robot = Monitored()
    robot.show(0.9)
    robot.show(0.9, 1.0, speed=1e6)
    assert robot.show(0.9, 2.0).charge > 0.8


def test_a_restarted_process_goes_on_with_its_count() -> None:
    log = BatteryLog(
        standing_power=30.0, energy_per_metre=25.0, seconds_per_metre=5.0, charge=0.5, measured=0.5, windows=3
    )
    status = Monitored(restored={"battery/log": log}).show(0.9)
    assert status.charge < 0.5 and status.standing_power == pytest.approx(30.0)


def test_the_log_is_kept_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "state"))
    kinds = {**MONITOR, "battery_log": "chefbot.devices.battery_log:BatteryLogStore"}
    first = Monitored(kinds)
    first.show(0.8)
    path = tmp_path / "state" / f"{ROBOT.name}.battery.json"
    stored = read_state(path, LogFile)
    assert stored is not None and stored.charge == pytest.approx(0.78, abs=0.05)
    values = json.loads(path.read_text())
    path.write_text(json.dumps({**values, "standing_power": 33.0}))
    assert Monitored(kinds).show(0.9).standing_power == pytest.approx(33.0)


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b'{"standing_power": 1e99}', b"\xff\xfe", b"x" * 20_000, b'{"a": NaN}']
)
def test_a_damaged_log_is_reported_in_a_sentence(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    (tmp_path / f"{ROBOT.name}.battery.json").write_bytes(content)
    robot = Monitored({**MONITOR, "battery_log": "chefbot.devices.battery_log:BatteryLogStore"})
    robot.run(0.1)
    (notice,) = robot.messages("battery_log/notice")
    assert "battery.json" in notice.data and "\n" not in notice.data
    assert (
        robot.show(0.9).level == "ok"
        and read_state(tmp_path / f"{ROBOT.name}.battery.json", LogFile) is not None
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_costs_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    tmp_path.chmod(0o500)
    robot = Monitored({**MONITOR, "battery_log": "chefbot.devices.battery_log:BatteryLogStore"})
    assert robot.show(0.9).level == "ok"
    assert len(robot.messages("battery_log/notice")) == 1


class Served(NodeRunner):
    """The delivery node on a map of a hall, with a battery that the test gives."""

    def __init__(self) -> None:
        super().__init__(DELIVERY, {})
        self.loop.publish(
            "map",
            OccupancyGrid.of(Header.of(0, "map"), Grid(walled(12.0, 6.0).cells, 0.05, -6.0, -3.0)),
            "map_server",
            latched=True,
        )
        self.at(0.0)

    def at(self, x: float) -> None:
        """Put the robot somewhere."""
        frames = (("map", "odom", SE2(x, 0.0, 0.0)), ("odom", "base_link", SE2(0.0, 0.0, 0.0)))
        for parent, child, pose in frames:
            stamped = TransformStamped.of(self.loop.now_ns, parent, child, pose)
            self.loop.publish("tf", TFMessage((stamped,)), "localization", from_device=True)
        self.run(0.1)

    def battery(self, metres: float, level: str = "ok") -> None:
        status = BatteryStatus(
            level=level, charge=0.3, energy=10.0 * metres, energy_per_metre=10.0, description="Low."
        )
        self.loop.publish("battery_status", status, "battery", from_device=True)
        self.run(0.1)

    def publish(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "client", from_device=True)
        self.run(0.1)

    @property
    def now(self) -> Any:
        return self.messages("delivery_status")[-1]


def test_an_order_beyond_the_energy_is_refused_in_a_sentence() -> None:
    robot = Served()
    robot.battery(7.0)
    robot.publish("order", Order(("table 2",), "a"))
    assert robot.now.state == "failed" and robot.now.description.startswith(
        "Table 2 refused: the battery has"
    )
    assert "a" in robot.now.accepted and not robot.system.nodes["navigator"].goals
    robot.battery(9.0)
    robot.publish("order", Order(("table 2",), "b"))
    assert robot.now.state == "driving", "the route is 6 m, with its margin 7.8 m"


def test_an_errand_beyond_the_energy_is_a_notice() -> None:
    robot = Served()
    robot.battery(3.0)
    errand = Errand("", PoseStamped(Header.of(0, "map"), Pose.of(SE2(5.0, 0.0, 0.0))), "now")
    robot.publish("errand", errand)
    (notice,) = robot.messages("delivery/notice")
    assert "the round needs 10 m" in notice.data and not robot.system.nodes["navigator"].goals


def test_a_weak_battery_in_a_round_ends_at_a_parking_place() -> None:
    robot = Served()
    robot.battery(500.0)
    robot.publish("order", Order(("table_2",), "a"))
    robot.run(3.0)
    robot.publish("loaded", Empty())
    robot.at(3.0)
    robot.battery(0.0, "park")
    robot.run(3.0)
    x, goals = 3.0, robot.system.nodes["navigator"].goals
    assert robot.now.state == "idle" and "Parked" in robot.now.description
    parked = robot.messages("navigate_to_pose/_action/send_goal")[-1].goal.pose.pose.position
    assert abs(parked.y) > 2.4 and abs(parked.x - x) < 1.5 and goals[-1] == parked.x
    robot.publish("order", Order(("table_1",), "b"))
    assert "has to be charged" in robot.now.description
    robot.battery(500.0)
    robot.publish("order", Order(("table_1",), "c"))
    assert robot.now.state == "driving"


def test_a_lost_robot_keeps_the_place_of_its_round() -> None:
    robot = Served()
    robot.publish("localization_status", LocalizationStatus(localized=False))
    robot.system.nodes["navigator"].__class__.fails = 1
    try:
        robot.publish("order", Order(("table_1",), "a"))
        robot.run(5.0)
        assert robot.now.state == "driving" and len(robot.system.nodes["navigator"].goals) == 1
        robot.publish("localization_status", LocalizationStatus(localized=True))
        robot.run(10.0)
        assert robot.now.state == "loading" and not robot.now.skipped_reasons
    finally:
        robot.system.nodes["navigator"].__class__.fails = 0

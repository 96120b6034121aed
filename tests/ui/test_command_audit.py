"""What the audit log records of commands, driving and parameters that others change; and the orders of missions."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import DeliveryStatus, FollowOrder, NavigationStatus, PatrolOrder
from chefbot.msgs.rcl_interfaces import Parameter, ParameterEvent, ParameterValue
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import NoParams
from chefbot.ui import commands as do
from chefbot.ui.access.audit_log import AuditEntry, Kind, audit_path, read_entries
from chefbot.ui.access.audited_device import NETWORK, AuditedDevice
from chefbot.ui.access.command_audit import MAX_IDS, CommandAudit
from chefbot.ui.missions.mission_device import MissionDevice

Record = tuple[Kind, tuple[str, str, str], str, dict[str, Any], str]


class Log:
    """Keeps what is recorded."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def record(self, *entry: Any) -> None:
        self.records.append(entry)  # type: ignore[arg-type]

    @property
    def actions(self) -> list[tuple[str, str]]:
        """Who did what."""
        return [(who[0], action) for _, who, action, _, _ in self.records]


def client(name: str, *, only_stop: bool = False) -> Any:
    return SimpleNamespace(visitor=(name, "waiter"), address="192.168.1.7", only_stop=only_stop)


ANNA, BERT = client("anna"), client("bert")


@pytest.fixture
def log() -> Log:
    return Log()


@pytest.fixture
def audit(log: Log) -> CommandAudit:
    return CommandAudit(log)  # type: ignore[arg-type]


def test_a_command_is_recorded_with_who_and_what(log: Log, audit: CommandAudit) -> None:
    audit.command(ANNA, do.Deliver(["table_1"]), "")
    audit.command(ANNA, do.GoPlace("nowhere"), "no such place")
    assert log.records == [
        (Kind.COMMAND, ("anna", "waiter", "192.168.1.7"), "deliver", {"tables": ["table_1"]}, ""),
        (Kind.COMMAND, ("anna", "waiter", "192.168.1.7"), "go_place", {"name": "nowhere", "when": ""},
         "no such place"),
    ]  # fmt: skip


def test_looking_is_not_recorded_even_if_it_is_refused(log: Log, audit: CommandAudit) -> None:
    zone = do.PutZone("", "keep_out", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], preview=True)
    audit.command(ANNA, zone, "")
    for refusal in ("", "At most 12 topics can be watched at once"):
        audit.command(ANNA, do.Inspect(["/odom"]), refusal)
    audit.command(ANNA, do.Drive(1.0, 0.0), "somebody else drives")
    assert log.actions == [("anna", "drive")]


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        (do.Stop("a"), Kind.SAFETY),
        (do.Withdraw("a"), Kind.SAFETY),
        (do.ReleaseStop(), Kind.SAFETY),
        (do.Cancel(), Kind.COMMAND),
        (do.Goal(1.0, 2.0, 0.0), Kind.COMMAND),
    ],
)
def test_only_the_emergency_stop_is_of_safety(
    log: Log, audit: CommandAudit, command: do.OperatorCommand, kind: Kind
) -> None:
    audit.command(ANNA, command, "")
    assert [one[0] for one in log.records] == [kind]


def test_one_press_that_is_sent_again_is_one_entry(log: Log, audit: CommandAudit) -> None:
    for _ in range(5):
        audit.command(ANNA, do.Stop("press-1"), "")
    audit.command(ANNA, do.Stop("press-2"), "")
    for _ in range(2):
        audit.command(ANNA, do.Stop(), "")  # a client without numbers
    assert [one[3] for one in log.records] == [{"id": "press-1"}, {"id": "press-2"}, {"id": ""}, {"id": ""}]


def test_a_press_of_long_ago_is_recorded_again(log: Log, audit: CommandAudit) -> None:
    for number in range(MAX_IDS + 1):
        audit.command(ANNA, do.Stop(f"{number}"), "")
    audit.command(ANNA, do.Stop(f"{MAX_IDS}"), "")
    audit.command(ANNA, do.Stop("0"), "")
    assert [one[3]["id"] for one in log.records[MAX_IDS:]] == [f"{MAX_IDS}", "0"]


def test_driving_is_a_begin_and_an_end(log: Log, audit: CommandAudit) -> None:
    for driver in (None, ANNA, ANNA, ANNA, None, None):
        if driver is not None:
            audit.command(driver, do.Drive(0.5, 0.0), "")
        audit.driver(driver)
    assert log.actions == [("anna", "drive"), ("anna", "drive ended")]


def test_a_driver_who_takes_over_ends_the_other_drive(log: Log, audit: CommandAudit) -> None:
    for driver in (ANNA, BERT, None):
        audit.driver(driver)
    assert log.actions == [
        ("anna", "drive"), ("anna", "drive ended"), ("bert", "drive"), ("bert", "drive ended")
    ]  # fmt: skip


def test_a_refused_drive_is_recorded(log: Log, audit: CommandAudit) -> None:
    audit.command(BERT, do.Drive(0.5, 0.0), "anna drives")
    assert log.actions == [("bert", "drive")] and log.records[0][4] == "anna drives"


def test_connections_show_whether_they_may_only_stop(log: Log, audit: CommandAudit) -> None:
    for one in (ANNA, client("guest", only_stop=True)):
        audit.connected(one)
        audit.disconnected(one)
    assert [(one[2], one[3]) for one in log.records] == [
        ("connected", {}), ("disconnected", {}), ("connected", {"only_stop": True}), ("disconnected", {})
    ]  # fmt: skip
    assert {one[0] for one in log.records} == {Kind.CONNECTION}


def test_without_a_log_nothing_is_recorded() -> None:
    audit = CommandAudit(None)
    audit.connected(ANNA)
    audit.command(ANNA, do.Stop("a"), "")
    audit.driver(ANNA)
    audit.disconnected(ANNA)


# ---- the devices


class Audited(AuditedDevice):
    """The base class alone."""

    params: NoParams


class Mission(MissionDevice):
    """The base class alone."""

    params: NoParams


class Page(NodeRunner):
    """A device whose state is in a folder of the test."""

    def __init__(self, kind: str, state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("CHEFBOT_STATE", str(state))
        super().__init__({"page": f"{__name__}:{kind}"}, {})
        self.device: Any = self.system.nodes["page"]
        self.run(0.0)

    def ended(self) -> list[AuditEntry]:
        """Stop the device and return the entries."""
        self.system.stop()
        return list(read_entries(audit_path(ROBOT.name)))


def test_parameters_changed_elsewhere_are_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Page("Audited", tmp_path, monkeypatch)
    changed = (Parameter("settings.weight", ParameterValue(type=3, double_value=2.5)),)
    page.loop.publish("/parameter_events", ParameterEvent(Time(), "/controller", (), changed), "wire")
    here = {"node": "planner", "params": {"costmap.padding": 0.05}}
    page.loop.publish("chefbot/params", String(msgspec.json.encode(here).decode()), "container")
    page.run(0.0)
    first, second = page.ended()
    assert first.details == {"node": "/controller", "params": {"settings.weight": 2.5}}
    assert second.details == here
    for entry in (first, second):
        assert (entry.name, entry.role, entry.address) == NETWORK and entry.action == "parameter"


def test_a_log_that_cannot_be_written_is_a_notice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Page("Audited", tmp_path, monkeypatch)
    page.device._warn("the disk is full")
    page.run(1.0)
    (notice,) = page.messages("page/notice")
    assert notice.data == "Warning: the disk is full."
    assert page.ended() == []


def test_orders_of_missions_are_published(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Page("Mission", tmp_path, monkeypatch)
    page.device._execute_mission(do.Patrol(["kitchen", "table_1"], 3, without_stops=True))
    page.device._execute_mission(do.Follow(7))
    page.run(0.0)
    (patrol,), (follow,) = page.messages("patrol"), page.messages("follow_order")
    assert isinstance(patrol, PatrolOrder) and isinstance(follow, FollowOrder)
    assert (patrol.places, patrol.rounds, patrol.without_stops) == (("kitchen", "table_1"), 3, True)
    assert follow.person == 7
    assert page.messages("round_choice") == []
    page.ended()


def test_a_mission_ends_the_drive_home_and_old_reasons(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = Page("Mission", tmp_path, monkeypatch)
    page.loop.publish(
        "navigation_status",
        NavigationStatus(state="idle", reason="The emergency stop ended the goal."),
        "test",
    )
    page.loop.publish("delivery_status", DeliveryStatus(state="returning", place="home"), "test")
    page.run(0.1)
    assert page.device._navigation_reason(exploring=False) == "The emergency stop ended the goal."
    page.device._execute_mission(do.Follow(7))
    page.run(0.1)
    assert [choice.data for choice in page.messages("round_choice")] == ["end"]
    assert page.device._navigation_reason(exploring=False) == ""
    page.loop.publish("navigation_status", NavigationStatus(state="idle", reason="No progress."), "test")
    page.run(0.1)
    assert page.device._navigation_reason(exploring=False) == "No progress."
    page.ended()

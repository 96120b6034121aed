"""Tests that fault events are read from plain data, and that errors are one sentence with the nearest word."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from chefbot.config import ConfigError, build
from chefbot.errors import UserError
from chefbot.sim.faults import events as e
from chefbot.sim.faults.schedule import FaultSchedule, begin_sentence, parse_request

GOOD: list[tuple[dict[str, Any], e.InjectedFault]] = [
    (
        {"at": 30, "until": 45, "fault": "freeze", "sensor": "lidar"},
        e.SensorFreeze(at=30.0, until=45.0, sensor="lidar"),
    ),
    ({"at": 1, "fault": "bump"}, e.Bump(at=1.0)),
    ({"at": 1, "fault": "carried", "to": [1, 2, 0.5]}, e.Carried(at=1.0, to=(1.0, 2.0, 0.5))),
    ({"at": 1, "fault": "slow", "link": "page"}, e.Slow(at=1.0, link="page")),
]
BAD = [
    ({"at": 1, "fault": "freez", "sensor": "lidar"}, r"unknown fault 'freez' \(did you mean 'freeze'\?\)"),
    ({"at": 1, "fault": "freeze", "sensor": "lidr"}, r"\[0\].sensor: .*'lidr' \(did you mean 'lidar'\?\)"),
    ({"at": 1, "fault": "freeze", "sensr": "lidar"}, r"'\[0\].sensr' \(did you mean 'sensor'\?\)"),
    ({"at": 1, "fault": "freeze"}, "'.*sensor' is missing"),
    ({"at": -1, "fault": "voltage_drop"}, r"\[0\].at: -1 must be at least 0"),
    ({"at": 5, "until": 4, "fault": "voltage_drop"}, "`until` is 4 s, but must be later than `at`, 5 s"),
    ({"at": 5, "until": 9, "fault": "bump"}, "unknown key '.*until'"),
    ({"at": 1, "fault": "slow"}, "either node or link"),
    ({"at": 1, "fault": "slow", "node": "a", "link": "b"}, "either node or link"),
    ({"at": 1, "fault": "slow", "node": "a", "topics": ["b"]}, "of a link"),
    ({"at": 1, "fault": "offset", "sensor": "imu", "yaw": 1}, "needs rate"),
    ({"at": 1, "fault": "offset", "sensor": "lidar"}, "needs yaw or range"),
    ({"at": 1, "fault": "slip", "wheel": "both", "share": float("nan")}, "not a finite number"),
    ({"at": 1}, "must be a section with the key 'fault'"),
    (7, "must be a section with the key 'fault'"),
]


@pytest.mark.parametrize(("plain", "event"), GOOD, ids=lambda value: str(value)[:40])
def test_an_event_is_read_and_written(plain: dict[str, Any], event: e.InjectedFault) -> None:
    assert build([plain], list[e.FaultEvent], "file") == [event]
    assert build([msgspec.to_builtins(event)], list[e.FaultEvent], "file") == [event]


@pytest.mark.parametrize(("plain", "expected"), BAD, ids=lambda value: str(value)[:50])
def test_a_wrong_event_is_refused_in_one_sentence(plain: Any, expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        build([plain], list[e.FaultEvent], "file")


def test_the_simulator_refuses_faults_of_nodes() -> None:
    with pytest.raises(ConfigError, match="unknown fault 'killed'"):
        build([{"at": 1, "fault": "killed", "node": "planner"}], list[e.SimulatorFault], "file")


def test_every_kind_has_a_word_of_its_own() -> None:
    assert len({kind.__struct_config__.tag for kind in e.KINDS}) == len(e.KINDS) == 21


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("freeze lidar", e.SensorFreeze(at=2.0, sensor="lidar")),
        ("slip left share=0.2", e.WheelSlip(at=2.0, wheel="left", share=0.2)),
        ("slow planner seconds=1", e.Slow(at=2.0, node="planner", seconds=1.0)),
        ("slow link=page", e.Slow(at=2.0, link="page")),
        ("voltage_drop", e.VoltageDrop(at=2.0)),
        ("none", ""),
        ("none lidar", "lidar"),
    ],
)
def test_requests_have_the_keys_of_the_events(text: str, expected: object) -> None:
    assert parse_request(text, 2_000_000_000) == expected


def test_a_notice_names_fault_target_strength_and_end() -> None:
    event = e.SensorNoise(at=1.0, until=4.0, sensor="imu")
    assert begin_sentence(event) == "Fault begins: noise of imu (share 0.3), until 4 s."


def test_a_schedule_begins_and_ends_events_in_their_order() -> None:
    seen: list[str] = []
    events = [e.Bump(at=3.0), e.VoltageDrop(at=1.0, until=3.0), e.WheelStall(at=2.0, wheel="left", until=2.5)]
    schedule = FaultSchedule[Any](events, lambda _: None, lambda _: None, seen.append)
    assert schedule.times_ns() == [10**9, 2 * 10**9, 25 * 10**8, 3 * 10**9]
    for time_ns in schedule.times_ns():
        schedule.advance(time_ns)
    assert [text.split()[1:3] for text in seen] == [
        ["begins:", "voltage_drop"],
        ["begins:", "stall"],
        ["ends:", "stall"],
        ["ends:", "voltage_drop."],
        ["begins:", "bump"],
    ]


def test_an_impossible_event_is_reported_and_not_active() -> None:
    def refuse(_: Any) -> None:
        raise UserError("no such sensor")

    seen: list[str] = []
    schedule = FaultSchedule[Any]([e.VoltageDrop(at=1.0, until=3.0)], refuse, lambda _: None, seen.append)
    schedule.advance(2 * 10**9)
    assert seen == ["Fault impossible: voltage_drop: no such sensor."] and not schedule.active

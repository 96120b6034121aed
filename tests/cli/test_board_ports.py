"""`chefbot board find`: what it reports about the serial ports, and the udev rule that it proposes."""

from __future__ import annotations

import grp
import os
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from serial.tools import list_ports

from chefbot.cli.board import ports
from chefbot.cli.board.ports import BOARDS, serial_port_lines
from chefbot.devices import serial_ports
from chefbot.devices.serial_ports import BOARD_VENDORS

RULE = re.compile(r'ATTRS\{idVendor\}=="([0-9a-f]{4})", ATTRS\{idProduct\}=="([0-9a-f]{4})"')
ARDUINO, CLONE, STRANGER = (0x2341, 0x0042), (0x1A86, 0x7523), (0x1234, 0x00AB)


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """`plugged((vendor, product), ...)` are the only serial ports; returns their paths."""
    monkeypatch.setattr(os, "access", lambda path, _: not Path(path).name.startswith("closed"))
    monkeypatch.setattr(os, "getgroups", lambda: [70001])

    def plug(
        *numbers: tuple[int | None, int | None], state: str = "open", text: str = "USB serial"
    ) -> list[str]:
        files = [tmp_path / f"{state}{i}" for i in range(len(numbers))]
        for file in files:
            file.touch()
        found = [
            SimpleNamespace(device=str(file), description=text, vid=vid, pid=pid, serial_number=None)
            for file, (vid, pid) in zip(files, numbers, strict=True)
        ]
        monkeypatch.setattr(list_ports, "comports", lambda: found)
        return [str(file) for file in files]

    return plug


def group_of_ports(monkeypatch: pytest.MonkeyPatch, *members: str, number: int = 20) -> None:
    """Every file belongs to the group `dialout`; no other group has a name."""

    def getgrgid(gid: int) -> grp.struct_group:
        if gid == 70001:
            raise KeyError("getgrgid(): gid not found: 70001")
        return grp.struct_group(("dialout", "x", number, list(members)))

    monkeypatch.setattr(grp, "getgrgid", getgrgid)


def rules(lines: list[str]) -> list[tuple[int, int]]:
    found = (RULE.search(line) for line in lines)
    return [(int(one[1], 16), int(one[2], 16)) for one in found if one]


def test_without_a_port_the_rule_names_all_known_boards(plugged: Any) -> None:
    plugged()
    lines = serial_port_lines()
    assert lines[0] == "serial ports: no device is plugged in"
    assert rules(lines) == list(BOARDS.values())


def test_every_board_of_the_rule_has_a_known_vendor() -> None:
    assert {vendor for vendor, _ in BOARDS.values()} <= set(BOARD_VENDORS)


def test_a_board_that_may_be_opened_needs_no_rule(plugged: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOGNAME", "ann")
    (path,) = plugged(ARDUINO)
    assert serial_port_lines() == [
        "serial ports:",
        f"  {path}: USB serial [2341:0042, Arduino]; ann may open it",
    ]


def test_a_port_of_an_unknown_vendor_gets_the_rule_of_all(plugged: Any) -> None:
    plugged(STRANGER, (None, None))
    lines = serial_port_lines()
    assert "[1234:00ab, not a known board]" in lines[1]
    assert "[" not in lines[2].split(":", 1)[1], "a port that is not USB has no ids"
    assert rules(lines) == list(BOARDS.values())


def test_the_rule_names_each_board_that_is_plugged_in_once(
    plugged: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    group_of_ports(monkeypatch)
    plugged(ARDUINO, CLONE, ARDUINO, state="closed")  # all three describe themselves as "USB serial"
    assert sorted(rules(serial_port_lines())) == sorted([ARDUINO, CLONE])


@pytest.mark.parametrize(
    ("members", "number", "hint"),
    [
        ((), 20, "the rule below, or sudo usermod -aG dialout ann, then log out and in"),
        (("bob", "ann"), 20, "the rule below, or log out and in again"),
        ((), 70001, "group dialout, whose members may not either: the rule below"),
    ],
)
def test_a_port_without_permission_names_the_remedy(
    plugged: Any, monkeypatch: pytest.MonkeyPatch, members: tuple[str, ...], number: int, hint: str
) -> None:
    monkeypatch.setenv("LOGNAME", "ann")
    group_of_ports(monkeypatch, *members, number=number)
    plugged(ARDUINO, state="closed")
    line = serial_port_lines()[1]
    assert "ann may not open it; it belongs to group dialout" in line and line.endswith(hint)


def test_a_user_and_a_group_without_a_name_are_reported(
    plugged: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody() -> str:
        raise KeyError("getpwuid(): uid not found: 1234")

    monkeypatch.setattr("getpass.getuser", nobody)
    monkeypatch.setattr(os, "getuid", lambda: 1234)
    monkeypatch.setattr(grp, "getgrgid", lambda gid: {}[gid])
    plugged(ARDUINO, state="closed")
    assert serial_port_lines()[1].endswith("; 1234 may not open it")


def test_no_rule_is_proposed_where_there_is_no_udev(plugged: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "darwin")
    plugged()
    assert serial_port_lines() == ["serial ports: no device is plugged in"]


def test_the_lines_are_printed_as_they_are(plugged: Any, capsys: pytest.CaptureFixture[str]) -> None:
    plugged(STRANGER, text="[red]odd[/red]")
    ports.print_serial_ports()
    assert "[red]odd[/red]" in capsys.readouterr().out


def test_each_port_has_a_name_that_lasts(
    plugged: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """By its device or, of equal adapters, by its socket; udev links one of them only by device."""
    first, second, third = plugged(ARDUINO, CLONE, CLONE)
    for link, path in (
        ("by-id/arduino", first),
        ("by-id/clone", second),
        ("by-path/1", second),
        ("by-path/2", third),
    ):
        (tmp_path / link).parent.mkdir(exist_ok=True)
        (tmp_path / link).symlink_to(path)
    monkeypatch.setattr(serial_ports, "SERIAL_LINKS", tmp_path)
    lines = [line for line in serial_port_lines() if "open it" in line]
    named = [line.split("always ")[1].removeprefix(f"{tmp_path}/") for line in lines]
    assert named == ["by-id/arduino", "by-path/1", "by-path/2"]

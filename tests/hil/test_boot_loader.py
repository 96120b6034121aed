"""Tests that the driver finds a Mega with its boot loader, which any byte in the first second keeps running."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from chefbot.board.autodetect import DETECTION_TIMEOUT_NS, ProtocolProbe
from chefbot.board.link import BoardLink
from chefbot.board.messages import MotionLine, parse
from chefbot.board.status_codes import BoardFlag
from chefbot.robot.load import load_robot
from tests.devices.driven import Driven
from tests.firmware.emulators import MegaWithBootLoader
from tests.hil.usb_mega import UsbMega

STEP_NS = 20_000_000
BOOT_NS = 800_000_000
"""Time that the boot loader waits for a byte."""
EXTENDED_BOOT_NS = 5_000_000_000
"""Time that the boot loader waits for more after a byte within BOOT_NS."""
MARGIN_NS = 500_000_000
ROBOT = load_robot("chefbot")
OtherProgram = Callable[[int], bytes]


@pytest.fixture(scope="module")
def board() -> Iterator[MegaWithBootLoader]:
    with closing(MegaWithBootLoader()) as mega:
        yield mega


def silence(_: int) -> bytes:
    return b""


def modem_manager(now_ns: int) -> bytes:
    """Bytes that a modem manager sends to each new serial port."""
    return b"AT\r" if now_ns <= 1_000_000_000 and now_ns % 100_000_000 == 0 else b""


def time_to_find(board: MegaWithBootLoader, other_program: OtherProgram, token: int = 7) -> int:
    """Return the board's time from the opening of its port until it is found, ns."""
    board.reset()
    probe, now = ProtocolProbe(token, 0), 0
    while not probe.timed_out(now):
        board.write(other_program(now) + probe.data_to_send(now))
        sent = board.run(STEP_NS // 1000).sent
        now += STEP_NS
        if probe.receive_data(sent, now) == "board":
            return now
    raise AssertionError(f"not found within {DETECTION_TIMEOUT_NS / 1e9:g} s")


def test_board_is_found_as_soon_as_its_boot_loader_ends(board: MegaWithBootLoader) -> None:
    assert BOOT_NS < time_to_find(board, silence) < BOOT_NS + MARGIN_NS


@pytest.mark.slow
def test_board_is_found_while_another_program_writes_to_it(board: MegaWithBootLoader) -> None:
    assert (
        EXTENDED_BOOT_NS < time_to_find(board, modem_manager) < 1_000_000_000 + EXTENDED_BOOT_NS + MARGIN_NS
    )


@pytest.mark.slow
def test_a_reset_while_driving_costs_only_a_pause(board: MegaWithBootLoader) -> None:
    """The driver stops sending when the board does, so that the boot loader ends."""
    time_to_find(board, silence)
    link, now = BoardLink(ROBOT, 1), 0
    pressed_ns = 1_000_000_000

    def drive_until(condition: Callable[[], bool], limit_ns: int) -> None:
        nonlocal now
        while not condition():
            now += STEP_NS
            assert now < limit_ns
            board.set_imu_at_rest()
            board.write(link.data_to_send(now) + link.command(0.0, 0.0, now))
            link.receive_data(board.run(STEP_NS // 1000).sent, now)

    drive_until(lambda: now >= pressed_ns, pressed_ns + STEP_NS)
    assert link.session.is_open and link.session.handshakes == 1
    board.reset()
    drive_until(lambda: link.session.handshakes == 2, pressed_ns + 2 * EXTENDED_BOOT_NS)


def test_the_boot_loader_hides_the_reason_of_a_restart(board: MegaWithBootLoader) -> None:
    """A Mega does not report a restart by its watchdog (firmware/README.md)."""
    time_to_find(board, silence)
    board.open_session()
    board.send_command("r")
    board.run(BOOT_NS // 1000)
    lines = board.run(MARGIN_NS // 1000).sent.splitlines()
    motions = [line for raw in lines if isinstance(line := parse(raw), MotionLine)]
    assert motions and not any(line.flags & BoardFlag.WATCHDOG_RESTART for line in motions)


@pytest.mark.rotated("a lost board or sensor")
@pytest.mark.slow
def test_driver_finds_the_board_cold_and_with_its_cable_pulled(tmp_path: Path) -> None:
    with UsbMega(tmp_path / "port") as mega, Driven(str(mega.path)) as driven:
        wait_until_found(mega, driven)
        reconnect(mega, driven)


@pytest.mark.long
def test_board_is_found_in_each_of_a_hundred_starts(board: MegaWithBootLoader, tmp_path: Path) -> None:
    for n in range(100):
        board.run(137 * n)  # the driver may start at any time
        assert time_to_find(board, silence, token=n) < BOOT_NS + MARGIN_NS
    with UsbMega(tmp_path / "port") as mega, Driven(str(mega.path)) as driven:
        wait_until_found(mega, driven)
        for _ in range(100):
            reconnect(mega, driven)
        assert mega.opened == 101


def reconnect(mega: UsbMega, driven: Driven) -> None:
    """Pull the cable, plug it in again and wait until the driver has found the board."""
    mega.pull()
    driven.until(lambda: "its cable is unplugged" in driven.health, "the loss")
    mega.plug()
    wait_until_found(mega, driven)


def wait_until_found(mega: UsbMega, driven: Driven) -> None:
    """Wait for wheel ticks and for an open session."""
    count = len(driven.received.get("wheel_ticks", []))
    driven.until(lambda: len(driven.received.get("wheel_ticks", [])) > count + 10, "ticks")
    driven.until(lambda: mega.has_session, "a session")

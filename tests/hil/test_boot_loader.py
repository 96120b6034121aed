"""A Mega as it is sold: a byte within the first second keeps its boot loader from starting our program."""

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
from tests.firmware.benches import MegaAsSold
from tests.hil.plugged import PluggedMega

STEP_NS = 20_000_000
BOOT_NS = 800_000_000
"""The boot loader listens for so long."""
TRAPPED_NS = 5_000_000_000
"""It waits for more so long after a byte that came within."""
MARGIN_NS = 500_000_000
ROBOT = load_robot("chefbot")
Chatter = Callable[[int], bytes]


@pytest.fixture(scope="module")
def board() -> Iterator[MegaAsSold]:
    with closing(MegaAsSold()) as one:
        yield one


def silence(_: int) -> bytes:
    return b""


def modem_manager(now_ns: int) -> bytes:
    """It asks whatever is plugged in whether it is a modem."""
    return b"AT\r" if now_ns <= 1_000_000_000 and now_ns % 100_000_000 == 0 else b""


def time_to_find(board: MegaAsSold, others: Chatter, token: int = 7) -> int:
    """Nanoseconds of the board's time from the opening of its port to the verdict."""
    board.reset()
    probe, now = ProtocolProbe(token, 0), 0
    while not probe.timed_out(now):
        board.write(others(now) + probe.data_to_send(now))
        said = board.run(STEP_NS // 1000).said
        now += STEP_NS
        if probe.receive_data(said, now) == "board":
            return now
    raise AssertionError(f"not found within {DETECTION_TIMEOUT_NS / 1e9:g} s")


def test_board_is_found_as_soon_as_its_boot_loader_ends(board: MegaAsSold) -> None:
    assert BOOT_NS < time_to_find(board, silence) < BOOT_NS + MARGIN_NS


@pytest.mark.slow
def test_board_is_found_while_another_program_writes_to_it(board: MegaAsSold) -> None:
    assert TRAPPED_NS < time_to_find(board, modem_manager) < 1_000_000_000 + TRAPPED_NS + MARGIN_NS


@pytest.mark.slow
def test_a_reset_while_driving_costs_only_a_pause(board: MegaAsSold) -> None:
    """The driver falls silent when the board does, so that the boot loader ends."""
    time_to_find(board, silence)
    link, now = BoardLink(ROBOT, 1), 0
    pressed_ns = 1_000_000_000

    def drive_until(condition: Callable[[], bool], limit_ns: int) -> None:
        nonlocal now
        while not condition():
            now += STEP_NS
            assert now < limit_ns
            board.live_imu()
            board.write(link.data_to_send(now) + link.command(0.0, 0.0, now))
            link.receive_data(board.run(STEP_NS // 1000).said, now)

    drive_until(lambda: now >= pressed_ns, pressed_ns + STEP_NS)
    assert link.session.is_open and link.session.handshakes == 1
    board.reset()
    drive_until(lambda: link.session.handshakes == 2, pressed_ns + 2 * TRAPPED_NS)


def test_the_boot_loader_hides_the_reason_of_a_restart(board: MegaAsSold) -> None:
    """What README.md of the firmware says of a Mega's watchdog."""
    time_to_find(board, silence)
    board.shake_hands()
    board.say("r")
    board.run(BOOT_NS // 1000)
    said = board.run(MARGIN_NS // 1000).said.splitlines()
    motions = [line for raw in said if isinstance(line := parse(raw), MotionLine)]
    assert motions and not any(line.flags & BoardFlag.WATCHDOG_RESTART for line in motions)


@pytest.mark.slow
def test_driver_finds_the_board_cold_and_with_its_cable_pulled(tmp_path: Path) -> None:
    with PluggedMega(tmp_path / "port") as mega, Driven(str(mega.path)) as driven:
        is_found(mega, driven)
        found_again(mega, driven)


@pytest.mark.long
def test_board_is_found_in_a_hundred_of_a_hundred_starts(board: MegaAsSold, tmp_path: Path) -> None:
    for n in range(100):
        board.run(137 * n)  # the driver comes at any moment
        assert time_to_find(board, silence, token=n) < BOOT_NS + MARGIN_NS
    with PluggedMega(tmp_path / "port") as mega, Driven(str(mega.path)) as driven:
        is_found(mega, driven)
        for _ in range(100):
            found_again(mega, driven)
        assert mega.opened == 101


def found_again(mega: PluggedMega, driven: Driven) -> None:
    mega.pull()
    driven.until(lambda: "its cable is out" in driven.health, "the loss")
    mega.plug()
    is_found(mega, driven)


def is_found(mega: PluggedMega, driven: Driven) -> None:
    count = len(driven.heard.get("wheel_ticks", []))
    driven.until(lambda: len(driven.heard.get("wheel_ticks", [])) > count + 10, "ticks")
    driven.until(lambda: mega.has_session, "a session")

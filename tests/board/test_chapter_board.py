"""The chapter's own board: understood, warned of, driven slowly, never left alone with a speed."""

from __future__ import annotations

import itertools
import math
import os
import select
import threading
import tty
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.devices.chapter_board import PERIOD, ROBOT, ChapterBoard
from tests.devices.driven import Driven

from chefbot.board.chapter_board import MAX_SPEED, NOTICE, ChapterLink
from chefbot.board.chapter_messages import ChapterReader, parse_chapter
from chefbot.board.command_gate import COMMAND_TIMEOUT_NS
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import Imu, Range

STEP_NS = round(PERIOD * 1e9)


class BoardBench:
    """Link and board, loop by loop."""

    def __init__(self) -> None:
        self.board, self.link, self.now = ChapterBoard(), ChapterLink(ROBOT), 0
        self.messages: list[Message] = []

    def run(self, loops: int, speed: float | None) -> None:
        for _ in range(loops):
            self.now += STEP_NS
            self.messages += self.link.receive_data(self.board.turn(), self.now)
            if speed is not None:
                wheel = speed / ROBOT.wheel_radius
                self.board.receive(self.link.command(wheel, wheel, self.now))
            self.board.receive(self.link.data_to_send(self.now))

    @property
    def ticks(self) -> list[WheelTicks]:
        return [message for message in self.messages if isinstance(message, WheelTicks)]


def test_the_host_controls_the_speed_for_a_board_without_pid() -> None:
    desk = BoardBench()
    desk.run(20, 0.0)
    desk.run(150, 0.1)
    assert math.isclose(desk.board.left_speed, 0.1, rel_tol=0.05)
    before, at = desk.ticks[-1].left, desk.board.place[0]
    desk.run(50, 0.1)
    assert abs(desk.ticks[-1].left - before - 4 * (desk.board.place[0] - at)) <= 4
    stamps = [ticks.header.stamp.ns for ticks in desk.ticks]
    assert all(b - a == STEP_NS for a, b in itertools.pairwise(stamps))  # over the wrap of its clock


def test_the_wheels_never_exceed_the_maximum_speed() -> None:
    desk = BoardBench()
    desk.run(20, 0.0)
    desk.run(200, 1.0)
    assert math.isclose(desk.board.left_speed, MAX_SPEED, rel_tol=0.05)


@pytest.mark.parametrize("fault", ["no commands", "not a number", "stop", "no ticks"])
def test_zero_speed_is_sent_repeatedly(fault: str) -> None:
    """It has no watchdog: silence would leave it driving."""
    desk = BoardBench()
    desk.run(20, 0.0)
    desk.run(50, 0.1)
    if fault == "stop":
        desk.board.receive(desk.link.stop(desk.now))
    if fault == "no ticks":
        desk.board.turn = lambda: b"t\t1\t0.02\n"  # type: ignore[method-assign]
    desk.run(
        COMMAND_TIMEOUT_NS // STEP_NS + 20,
        {"stop": 0.1, "no ticks": 0.1, "not a number": math.nan}.get(fault),
    )
    assert desk.board.duty == [0, 0]
    assert desk.link.data_to_send(desk.now) == b"s 0 0\r"


def test_after_a_stop_it_waits_for_a_zero_command() -> None:
    desk = BoardBench()
    desk.run(20, 0.0)
    desk.link.stop(desk.now)
    desk.link.clear(desk.now)
    desk.run(20, 0.1)
    assert desk.board.duty == [0, 0]
    desk.run(1, 0.0)
    desk.run(20, 0.1)
    assert desk.board.duty[0] > 0


def test_a_damaged_count_is_skipped_and_a_restart_followed() -> None:
    desk = BoardBench()
    desk.run(20, 0.0)
    good = desk.ticks[-1].left
    count = len(desk.ticks)
    desk.link.receive_data(b"e\t99999\t0\n", desk.now)
    desk.run(5, 0.0)
    assert [ticks.left for ticks in desk.ticks[count:]] == [good] * 5
    desk.board.place, desk.board.us = [-50_000.0, 7.0], 1_000
    count = len(desk.ticks)
    desk.run(10, 0.0)
    assert len(desk.ticks) - count >= 7 and desk.ticks[-1].left == -200_000


def test_other_sensors_report_their_uncertainty() -> None:
    desk = BoardBench()
    desk.run(5, 0.0)
    ranges = [message for message in desk.messages if isinstance(message, Range)]
    imus = [message for message in desk.messages if isinstance(message, Imu)]
    assert math.isclose(ranges[-1].range, 0.87, rel_tol=1e-6)
    assert imus[-1].angular_velocity_covariance[0] == imus[-1].linear_acceleration_covariance[0] == -1.0
    assert imus[-1].orientation_covariance[8] > 0.0
    status = desk.link.report("port", desk.now)
    assert status.level == 1 and "no watchdog" in status.message
    assert "not in volts" in {pair.key: pair.value for pair in status.values}["battery"]


@given(st.binary(max_size=300))
def test_random_bytes_do_no_harm(data: bytes) -> None:
    link = ChapterLink(ROBOT)
    link.receive_data(data, 0)
    assert link.data_to_send(0) == b"s 0 0\r"


def test_boot_messages_are_not_parsed_as_lines() -> None:
    for line in (b"Initializing I2C devices...\r", b"Reset Done\r", b"e\t1\t2\r", b"e 1 2", b"e\t1", b"x\t1"):
        assert parse_chapter(line) is None
    reader = ChapterReader()
    assert reader.read(b"Reset Done\r\n" * 3) == [] and reader.malformed == 3


@pytest.fixture
def port() -> Iterator[tuple[str, ChapterBoard]]:
    """The board on a pty, in real time."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    board, ending = ChapterBoard(), threading.Event()

    def live() -> None:
        while not ending.wait(PERIOD):
            if select.select([ours], [], [], 0)[0]:
                board.receive(os.read(ours, 4096))
            if select.select([], [ours], [], 0)[1]:
                try:
                    os.write(ours, board.turn())
                except BlockingIOError:
                    continue  # nobody reads: lost, as on a wire

    thread = threading.Thread(target=live, daemon=True)
    thread.start()
    yield os.ttyname(theirs), board
    ending.set()
    thread.join()
    os.close(ours)
    os.close(theirs)


@pytest.mark.slow
def test_the_driver_recognizes_the_board_by_its_lines(port: tuple[str, ChapterBoard]) -> None:
    path, board = port
    driven = Driven(path)
    try:
        driven.until(lambda: len(driven.received.get("wheel_ticks", [])) > 5, "ticks")
        driven.rest()
        driven.speed = 0.1
        driven.until(lambda: abs(board.left_speed - 0.1) < 0.02, "the speed")
        driven.speed = None
        driven.until(lambda: board.duty == [0, 0], "a stop")
        notices = [message.data for message in driven.received["board/notice"]]  # type: ignore[attr-defined]
        assert any(NOTICE in text for text in notices)
    finally:
        driven.device.stop()

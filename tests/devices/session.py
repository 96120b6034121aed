"""A session with the board for tests: its handshake answered, and what it sends taken apart."""

from __future__ import annotations

from collections.abc import Iterator

from tests.firmware.serial_lines import add_checksum

from chefbot.board import BoardSession, unframe
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
MS = 1_000_000
BITS = 1 << 32


def wrapped(value: int) -> int:
    """As the board writes a signed 32-bit counter."""
    return (value + BITS // 2) % BITS - BITS // 2


def motion(sequence: int, t: int, left: int = 0, right: int = 0, angle: int = 0, samples: int = 0) -> bytes:
    numbers = f"{t % BITS} {wrapped(left)} {wrapped(right)} {wrapped(angle)} {samples % 65536}"
    return add_checksum(f"e {sequence % 65536} {numbers} 0000")


def sent_lines(data: bytes) -> Iterator[list[str]]:
    for line in data.split(b"\n"):
        if line:
            text = unframe(line)
            assert text is not None
            yield text.split(" ")


def opened(first: int = 100) -> BoardSession:
    """A session with an answered handshake and a stop commanded, at 1 s."""
    session = BoardSession(ROBOT, token=6)
    (hello,) = sent_lines(session.data_to_send(0))
    ticks = round(1000 * ROBOT.motor.ticks_per_turn)
    answer = f"chefbot 1 test 00000000 {ticks} 100 1000 9000 9000 9000 9000 {first} 03"
    session.receive_data(add_checksum(f"v 0 {hello[1]} {answer}"), 0)
    assert session.is_open and session.refused is None
    session.receive_data(motion(1, 1_000_000), 1000 * MS)
    session.command(0.0, 0.0, 1000 * MS)
    return session


def speeds(data: bytes) -> list[tuple[int, int]]:
    return [(int(fields[2]), int(fields[3])) for fields in sent_lines(data) if fields[0] == "s"]

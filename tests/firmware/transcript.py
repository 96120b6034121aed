"""The talk that docs/protocol.md shows, spoken anew: `python -m tests.firmware.transcript` prints it."""

from __future__ import annotations

from tests.firmware.host_board import HostBoard
from tests.firmware.lines import framed

EXAMPLE = {
    "hash": 0x5C093193,
    "ticks_per_turn_milli": 8_400_000,
    "max_wheel": 10_909,
    "max_forward": 10_399,
    "max_turn": 10_695,
    "acceleration": 14_854,
    "no_load": 11_200,
    "lag": 132,
    "battery_stop": 11_000,
    "battery_low": 11_550,
    "imu_period": 2,
    "sonar_period": 10,
}
"""A robot much like the Chefbot, that stays as it is when the Chefbot's file changes."""


class Talk:
    """Notes every line from the computer, and from the board the first of each letter after it."""

    def __init__(self) -> None:
        self.board = HostBoard(EXAMPLE)
        self.board.lib.chefbot_board_echo(self.board.handle, 5831)
        self.board.lib.chefbot_board_battery(self.board.handle, 12180)
        self.lines: list[str] = []

    def say(self, text: str) -> None:
        self.board.write(framed(text))
        self.lines.append("> " + framed(text).decode().rstrip())

    def obey(self, letter: str, *numbers: int) -> None:
        self.board.sequence += 1
        self.say(" ".join([letter, str(self.board.sequence), *map(str, numbers)]))

    def hear(self, ms: float, letters: str) -> None:
        """Shows the last line of each letter said within `ms`."""
        last = {m.letter: m for m in self.board.advance(ms)}
        for letter in letters:
            message = last[letter]
            text = framed(" ".join([letter, str(message.sequence), *message.fields]))
            self.lines.append("< " + text.decode().rstrip())


def transcript() -> list[str]:
    """Handshake, a drive, a stop by the pin, its reset."""
    talk = Talk()
    talk.hear(400, "tbs")
    talk.say("v 7 1")
    talk.hear(10, "v")
    talk.board.sequence = int(talk.lines[-1].split("*")[0].split(" ")[-2])
    talk.obey("s", 0, 0)
    talk.hear(20, "e")
    talk.obey("s", 5200, 4800)
    for _ in range(9):
        talk.board.advance(10)
        talk.board.lib.chefbot_board_turn(talk.board.handle, 0, 18)
        talk.board.lib.chefbot_board_turn(talk.board.handle, 1, 16)
    talk.obey("s", 5200, 4800)
    talk.hear(90, "eisu")
    talk.board.lib.chefbot_board_estop(talk.board.handle, 1)
    talk.hear(20, "e")
    talk.obey("s", 5200, 4800)
    talk.hear(100, "s")
    talk.board.lib.chefbot_board_estop(talk.board.handle, 0)
    talk.hear(20, "e")
    talk.obey("c")
    talk.obey("s", 0, 0)
    talk.hear(20, "e")
    return talk.lines


if __name__ == "__main__":
    print("\n".join(transcript()))  # noqa: T201

"""The talk that docs/protocol.md shows, spoken anew: `python -m tests.firmware.transcript` prints it."""

from __future__ import annotations

from tests.firmware.host_board import HostBoard
from tests.firmware.lines import framed


class Talk:
    """Notes every line from the computer, and from the board the first of each letter after it."""

    def __init__(self) -> None:
        self.board = HostBoard()
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
    talk.obey("s", 2600, 2400)
    for _ in range(9):
        talk.board.advance(10)
        talk.board.lib.chefbot_board_turn(talk.board.handle, 0, 9)
        talk.board.lib.chefbot_board_turn(talk.board.handle, 1, 8)
    talk.hear(90, "eisu")
    talk.board.lib.chefbot_board_estop(talk.board.handle, 1)
    talk.hear(20, "e")
    talk.obey("s", 2600, 2400)
    talk.hear(100, "s")
    talk.board.lib.chefbot_board_estop(talk.board.handle, 0)
    talk.hear(20, "e")
    talk.obey("c")
    talk.obey("s", 0, 0)
    talk.hear(20, "e")
    return talk.lines


if __name__ == "__main__":
    print("\n".join(transcript()))  # noqa: T201

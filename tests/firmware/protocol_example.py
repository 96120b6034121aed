"""Records the example of docs/protocol.md; `python -m tests.firmware.protocol_example` prints it."""

from __future__ import annotations

from tests.firmware.host_board import HostBoard
from tests.firmware.serial_lines import add_checksum

EXAMPLE = {
    "hash": 0x5C093193,
    "ticks_per_turn_milli": 8_400_000,
    "max_wheel": 10_909,
    "max_forward": 10_399,
    "max_turn": 10_695,
    "acceleration": 14_854,
    "deceleration": 52_000,
    "no_load": 11_200,
    "lag": 132,
    "battery_stop": 11_000,
    "battery_low": 11_550,
    "imu_period": 2,
    "sonar_period": 10,
    "cliff_sensors": 0,
    "hold": 0,
    "enable_diag": 0,
}
"""Constants of a robot similar to the Chefbot, which do not depend on the Chefbot's robot file."""


class Recording:
    """Records every line of the computer, and of the board those of the given letters."""

    def __init__(self) -> None:
        self.board = HostBoard(EXAMPLE)
        self.board.lib.chefbot_board_echo(self.board.handle, 5831)
        self.board.lib.chefbot_board_battery(self.board.handle, 12180)
        self.lines: list[str] = []

    def send(self, text: str) -> None:
        self.board.write(add_checksum(text))
        self.lines.append("> " + add_checksum(text).decode().rstrip())

    def send_command(self, letter: str, *numbers: int) -> None:
        self.board.sequence += 1
        self.send(" ".join([letter, str(self.board.sequence), *map(str, numbers)]))

    def receive(self, ms: float, letters: str) -> None:
        """Advance by `ms` and record the last line of each letter."""
        last = {m.letter: m for m in self.board.advance(ms)}
        for letter in letters:
            message = last[letter]
            text = add_checksum(" ".join([letter, str(message.sequence), *message.fields]))
            self.lines.append("< " + text.decode().rstrip())


def record_example() -> list[str]:
    """Return the lines of a handshake, a drive, an emergency stop by the input and its reset."""
    recording = Recording()
    recording.receive(400, "tbs")
    recording.send("v 7 1")
    recording.receive(10, "v")
    recording.board.sequence = int(recording.lines[-1].split("*")[0].split(" ")[-2])
    recording.send_command("s", 0, 0)
    recording.receive(20, "e")
    recording.send_command("s", 5200, 4800)
    for _ in range(9):
        recording.board.advance(10)
        recording.board.lib.chefbot_board_turn(recording.board.handle, 0, 18)
        recording.board.lib.chefbot_board_turn(recording.board.handle, 1, 16)
    recording.send_command("s", 5200, 4800)
    recording.receive(90, "eisu")
    recording.board.lib.chefbot_board_estop(recording.board.handle, 1)
    recording.receive(20, "e")
    recording.send_command("s", 5200, 4800)
    recording.receive(100, "s")
    recording.board.lib.chefbot_board_estop(recording.board.handle, 0)
    recording.receive(20, "e")
    recording.send_command("c")
    recording.send_command("s", 0, 0)
    recording.receive(20, "e")
    return recording.lines


if __name__ == "__main__":
    print("\n".join(record_example()))  # noqa: T201

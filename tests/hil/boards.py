"""Boards whose time a test moves: the Mega's program in simavr, and the firmware compiled for this computer."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from tests.firmware.benches import Mega
from tests.firmware.host_board import HostBoard


class Output(NamedTuple):
    """What a board puts out at the end of a piece of time."""

    duty: tuple[int, int]
    drivers: bool
    said: bytes


class LockstepBoard(Protocol):
    """Time is the board's own, in microseconds."""

    def write(self, data: bytes) -> None:
        """Bytes from the computer."""

    def run(self, us: int) -> Output:
        """Time goes on."""

    def turn(self, wheel: int, quarter_steps: int) -> None:
        """The encoder of a wheel moves within the next milliseconds."""

    def imu(self, raw: tuple[int, ...]) -> None:
        """The registers: ax ay az temperature gx gy gz."""

    def set(self, name: str, value: int) -> None:
        """`estop` 0|1, `battery` mV, `echo` us, `imu_answers` 0|1."""

    def reset(self) -> None:
        """Its button is pressed."""

    def close(self) -> None:
        """No longer needed."""


class MegaBoard:
    """ATmega2560 in simavr; skips the test where simavr or the compiler is absent."""

    def __init__(self) -> None:
        self._bench = Mega()

    def write(self, data: bytes) -> None:
        self._bench.write(data)

    def run(self, us: int) -> Output:
        state = self._bench.run(us)
        return Output(state.duty, bool(state.drivers), state.said)

    def turn(self, wheel: int, quarter_steps: int) -> None:
        self._do(f"turn {wheel} {quarter_steps}")

    def imu(self, raw: tuple[int, ...]) -> None:
        self._do("imu " + " ".join(map(str, raw)))

    def set(self, name: str, value: int) -> None:
        self._do(f"{name} {value}")

    def reset(self) -> None:
        self._do("reset")

    def close(self) -> None:
        self._bench.close()

    def _do(self, command: str) -> None:
        assert self._bench.ask(command) == "ok"


class HostPort:
    """The library that the simulator and `chefbot board emulate` run."""

    def __init__(self) -> None:
        self._board = HostBoard()

    def write(self, data: bytes) -> None:
        if data:
            self._board.write(data)

    def run(self, us: int) -> Output:
        self._board.lib.chefbot_board_advance(self._board.handle, us)
        state = self._board.state
        return Output((state.duty[0], state.duty[1]), bool(state.drivers), self._board.read())

    def turn(self, wheel: int, quarter_steps: int) -> None:
        self._board.lib.chefbot_board_turn(self._board.handle, wheel, quarter_steps)

    def imu(self, raw: tuple[int, ...]) -> None:
        self._board.imu(*raw)

    def set(self, name: str, value: int) -> None:
        getattr(self._board.lib, f"chefbot_board_{name}")(self._board.handle, value)

    def reset(self) -> None:
        self._board.lib.chefbot_board_power_cycle(self._board.handle)

    def close(self) -> None:
        del self._board

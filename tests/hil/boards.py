"""Boards in lockstep with a test: the Mega's program in simavr, and the firmware compiled for this computer."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from tests.firmware.emulators import MegaEmulator
from tests.firmware.host_board import HostBoard


class Output(NamedTuple):
    """Outputs of a board at the end of a time step, and the bytes that it has sent in it."""

    duty: tuple[int, int]
    drivers: bool
    sent: bytes


class LockstepBoard(Protocol):
    """A board whose time advances only by `run`."""

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""

    def run(self, us: int) -> Output:
        """Advance the board's time by `us` microseconds."""

    def turn(self, wheel: int, quarter_steps: int) -> None:
        """Turn the encoder of a wheel within the next milliseconds."""

    def imu(self, raw: tuple[int, ...]) -> None:
        """Set the registers of the IMU: ax ay az temperature gx gy gz."""

    def set(self, name: str, value: int) -> None:
        """Set an input: `estop` 0|1, `battery` mV, `echo` us, `imu_answers` 0|1."""

    def reset(self) -> None:
        """Press the reset button."""

    def close(self) -> None:
        """End the board."""


class MegaBoard:
    """An ATmega2560 in simavr; skips the test if simavr or the compiler is not installed."""

    def __init__(self) -> None:
        self._emulator = MegaEmulator()

    def write(self, data: bytes) -> None:
        self._emulator.write(data)

    def run(self, us: int) -> Output:
        state = self._emulator.run(us)
        return Output(state.duty, bool(state.drivers), state.sent)

    def turn(self, wheel: int, quarter_steps: int) -> None:
        self._do(f"turn {wheel} {quarter_steps}")

    def imu(self, raw: tuple[int, ...]) -> None:
        self._do("imu " + " ".join(map(str, raw)))

    def set(self, name: str, value: int) -> None:
        self._do(f"{name} {value}")

    def reset(self) -> None:
        self._do("reset")

    def close(self) -> None:
        self._emulator.close()

    def _do(self, command: str) -> None:
        assert self._emulator.request(command) == "ok"


class HostPort:
    """The firmware's library for this computer, which the simulator and `chefbot board emulate` also use."""

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

"""The motor board's firmware, compiled for this computer: its C interface (firmware/ports/host/chefbot_board.h)."""

from __future__ import annotations

import ctypes
import math
import runpy
import subprocess
import sys
from ctypes import POINTER, c_char_p, c_double, c_int16, c_int32, c_uint32, c_uint64, c_void_p
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.board.firmware_constants import CONTROL_HZ, as_int32, firmware_constants
from chefbot.errors import UserError
from chefbot.robot.spec import GRAVITY, Robot

LIBRARY = Path(__file__).parent / "_firmware" / "libchefbot_board.so"
BUILDER = Path(__file__).parents[3] / "firmware" / "ports" / "host" / "build.py"
"""Only a checkout has it; there the firmware may be newer than the library."""
CONTROL_NS = 1_000_000_000 // CONTROL_HZ
DUTY_FULL = 1000
NO_ECHO = 0
LEFT, RIGHT = 0, 1
_ROOM = 65536


class FirmwareState(ctypes.Structure):
    """What the board puts out now; fields as in the header."""

    _fields_ = (
        ("time_us", c_uint64),
        ("duty", c_int32 * 2),
        ("drivers", c_int32),
        ("state", c_int32),
        ("flags", c_uint32),
        ("set", c_int32 * 2),
        ("ticks", c_uint32 * 2),
        ("illegal", c_uint32 * 2),
        ("refused", c_uint32),
        ("refusal", c_int32),
        ("restarts", c_uint32),
    )


class Firmware:
    """One board. Its time moves by `step` only; `state` and `imu` are its memory, looked at and written in place."""

    def __init__(self, robot: Robot) -> None:
        """Made for the robot as drawn, switched on."""
        self._library = library()
        values = _constants(robot)
        self._board = self._library.chefbot_board_create(values, len(values))
        if not self._board:
            raise RuntimeError(
                f"the board's firmware does not take the constants of {robot.name}: {values[:]}"
            )
        self._imu = (c_int16 * 7)()
        self.imu: NDArray[np.int16] = np.ctypeslib.as_array(self._imu)
        """The IMU's registers from the next `step` on: ax ay az temperature gx gy gz; see `imu_scale`."""
        self.state = FirmwareState()
        """After the last `step`."""
        self._line = ctypes.create_string_buffer(_ROOM)

    def __del__(self) -> None:
        if getattr(self, "_board", None):
            self._library.chefbot_board_destroy(self._board)

    def step(self, quarter_steps: tuple[int, int], millivolts: int) -> None:
        """One control step, 10 ms, after the encoders have moved so far and the battery fell to so much."""
        board, lib = self._board, self._library
        lib.chefbot_board_turn(board, LEFT, quarter_steps[LEFT])
        lib.chefbot_board_turn(board, RIGHT, quarter_steps[RIGHT])
        lib.chefbot_board_battery(board, millivolts)
        lib.chefbot_board_imu(board, self._imu)
        lib.chefbot_board_advance(board, CONTROL_NS // 1000)
        lib.chefbot_board_get(board, self.state)

    def hear(self, echo_us: int) -> None:
        """Round trip that the next pings hear, or NO_ECHO."""
        self._library.chefbot_board_echo(self._board, echo_us)

    def write(self, data: bytes) -> int:
        """Bytes of the computer, obeyed in the next step; how many the line took."""
        return int(self._library.chefbot_board_write(self._board, data, len(data)))

    def read(self) -> bytes:
        """All bytes for the computer so far."""
        count = self._library.chefbot_board_read(self._board, self._line, _ROOM)
        return ctypes.string_at(self._line, count)

    def press_estop(self, pressed: bool) -> None:
        """The button of the emergency stop."""
        self._library.chefbot_board_estop(self._board, pressed)

    def power_cycle(self) -> None:
        """Off and on: counters, session and faults are gone."""
        self._library.chefbot_board_power_cycle(self._board)


def imu_scale() -> tuple[float, float]:
    """LSB of the IMU's registers per m/s^2 and per rad/s, in the ranges that the firmware sets."""
    found = library()
    return found.chefbot_board_lsb_per_g() / GRAVITY, found.chefbot_board_lsb_per_degree() * math.degrees(1.0)


def serve(robot: Robot, link: Path) -> int:
    """Be a board at the path `link`, in real time, until SIGINT or SIGTERM; its exit code (ports/host/pty.cpp)."""
    values = _constants(robot)
    return int(library().chefbot_board_serve(values, len(values), bytes(link), 0.0))


def _constants(robot: Robot) -> ctypes.Array[c_int32]:
    """In the order of core/robot.h."""
    values = [as_int32(constant.value) for constant in firmware_constants(robot)]
    return (c_int32 * len(values))(*values)


@cache
def library() -> Any:
    """The library with the types of its functions; in a checkout, of the firmware as it is now.

    UserError where it is missing and cannot be made.
    """
    if BUILDER.exists():
        _renew()
    if not LIBRARY.exists():
        raise UserError(f"{LIBRARY} is missing: the package is not whole; install chefbot again")
    found = ctypes.CDLL(str(LIBRARY))
    found.chefbot_board_create.restype = c_void_p
    found.chefbot_board_create.argtypes = [POINTER(c_int32), c_uint32]
    found.chefbot_board_write.argtypes = [c_void_p, c_char_p, c_uint32]
    found.chefbot_board_read.argtypes = [c_void_p, c_char_p, c_uint32]
    found.chefbot_board_imu.argtypes = [c_void_p, POINTER(c_int16)]
    found.chefbot_board_lsb_per_g.restype = found.chefbot_board_lsb_per_degree.restype = c_double
    found.chefbot_board_serve.argtypes = [POINTER(c_int32), c_uint32, c_char_p, c_double]
    found.chefbot_board_get.argtypes = [c_void_p, POINTER(FirmwareState)]
    found.chefbot_board_turn.argtypes = [c_void_p, c_int32, c_int32]
    found.chefbot_board_advance.argtypes = [c_void_p, c_uint32]
    for name in ("battery", "echo", "estop"):
        getattr(found, f"chefbot_board_{name}").argtypes = [c_void_p, c_int32]
    for name in ("destroy", "power_cycle"):
        getattr(found, f"chefbot_board_{name}").argtypes = [c_void_p]
    return found


def _renew() -> None:
    """Compile where the library is missing or of other sources."""
    wanted = runpy.run_path(str(BUILDER))["fingerprint"]().encode()
    if LIBRARY.exists() and wanted in LIBRARY.read_bytes():
        return
    sys.stderr.write("Compiling the motor board's firmware for the simulator: some seconds, once.\n")
    command = [sys.executable, str(BUILDER), str(LIBRARY)]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise UserError(done.stderr.strip())

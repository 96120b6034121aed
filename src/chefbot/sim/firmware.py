"""The motor board's firmware compiled for this computer (C interface:
firmware/ports/host/chefbot_board.h)."""

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

from chefbot.board.firmware_constants import CONTROL_HZ, as_int32, firmware_constants
from chefbot.errors import UserError
from chefbot.robot.spec import GRAVITY, Robot

LIBRARY = Path(__file__).parent / "_firmware" / "libchefbot_board.so"
BUILDER = Path(__file__).parents[3] / "firmware" / "ports" / "host" / "build.py"
"""Build script, present only in a checkout, where the firmware may be newer than the library."""
CONTROL_NS = 1_000_000_000 // CONTROL_HZ
DUTY_FULL = 1000
NO_ECHO, NO_SENSOR = 0, -1
LEFT, RIGHT = 0, 1
_BUFFER_SIZE = 65536


class FirmwareState(ctypes.Structure):
    """Present outputs of the board; fields as in the C header."""

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
    """One board, whose time advances only by `step`; `state` and `imu` are its memory, accessed in place."""

    def __init__(self, robot: Robot) -> None:
        """Create a powered-on board configured for the robot as drawn."""
        self._library = library()
        values = _constants(robot)
        self._board = self._library.chefbot_board_create(values, len(values))
        if not self._board:
            raise RuntimeError(f"the firmware rejects the constants of {robot.name}: {values[:]}")
        self.imu = (c_int16 * 7)()
        """IMU registers read by the next `step`: ax ay az temperature gx gy gz; see `imu_scale`."""
        self.state = FirmwareState()
        """Outputs of the board after the last `step`."""
        self._buffer = ctypes.create_string_buffer(_BUFFER_SIZE)

    def __del__(self) -> None:
        if getattr(self, "_board", None):
            self._library.chefbot_board_destroy(self._board)

    def step(self, quarter_steps: tuple[int, int], millivolts: int) -> None:
        """Advance by one control step of 10 ms.

        quarter_steps: encoder edges (left, right) since the last step. millivolts: battery voltage.
        """
        board, lib = self._board, self._library
        lib.chefbot_board_turn(board, LEFT, quarter_steps[LEFT])
        lib.chefbot_board_turn(board, RIGHT, quarter_steps[RIGHT])
        lib.chefbot_board_battery(board, millivolts)
        lib.chefbot_board_imu(board, self.imu)
        lib.chefbot_board_advance(board, CONTROL_NS // 1000)
        lib.chefbot_board_get(board, self.state)

    def set_imu_answers(self, answers: bool) -> None:
        """Set whether the IMU answers on the bus."""
        self._library.chefbot_board_imu_answers(self._board, int(answers))

    def set_echo(self, echo_us: int) -> None:
        """Set the round-trip time of the following ultrasonic pings, us, or NO_ECHO or NO_SENSOR."""
        self._library.chefbot_board_echo(self._board, echo_us)

    def set_cliffs(self, bits: int) -> None:
        """Set which cliff sensors see no floor, a bit each."""
        self._library.chefbot_board_cliffs(self._board, bits)

    def power_cycle(self) -> None:
        """Switch the board off and on: its program starts again."""
        self._library.chefbot_board_power_cycle(self._board)

    def write(self, data: bytes) -> int:
        """Write bytes from the computer, processed in the next step; return how many the buffer took."""
        return int(self._library.chefbot_board_write(self._board, data, len(data)))

    def read(self) -> bytes:
        """Return all bytes that the board has sent since the last call."""
        count = self._library.chefbot_board_read(self._board, self._buffer, _BUFFER_SIZE)
        return ctypes.string_at(self._buffer, count)


def imu_scale() -> tuple[float, float]:
    """Return the IMU's sensitivity, LSB per m/s^2 and LSB per rad/s, in the ranges set by the firmware."""
    lib = library()
    return lib.chefbot_board_lsb_per_g() / GRAVITY, lib.chefbot_board_lsb_per_degree() * math.degrees(1.0)


def serve(robot: Robot, link: Path) -> int:
    """Run a board in real time on a pseudo-terminal linked at `link` until SIGINT or SIGTERM; return the exit
    code.

    See ports/host/pty.cpp.
    """
    values = _constants(robot)
    return int(library().chefbot_board_serve(values, len(values), bytes(link), 0.0))


def _constants(robot: Robot) -> ctypes.Array[c_int32]:
    """Return the robot's firmware constants in the order of core/robot.h."""
    values = [as_int32(constant.value) for constant in firmware_constants(robot)]
    return (c_int32 * len(values))(*values)


@cache
def library() -> Any:
    """Return the shared library with its function types; in a checkout it is rebuilt if the firmware changed.

    Raises UserError if it is missing and cannot be built.
    """
    if BUILDER.exists():
        _rebuild_if_stale()
    if not LIBRARY.exists():
        raise UserError(f"{LIBRARY} is missing: the installation is incomplete; reinstall chefbot")
    lib = ctypes.CDLL(str(LIBRARY))
    lib.chefbot_board_create.restype = c_void_p
    lib.chefbot_board_create.argtypes = [POINTER(c_int32), c_uint32]
    lib.chefbot_board_write.argtypes = [c_void_p, c_char_p, c_uint32]
    lib.chefbot_board_read.argtypes = [c_void_p, c_char_p, c_uint32]
    lib.chefbot_board_imu.argtypes = [c_void_p, POINTER(c_int16)]
    lib.chefbot_board_lsb_per_g.restype = lib.chefbot_board_lsb_per_degree.restype = c_double
    lib.chefbot_board_serve.argtypes = [POINTER(c_int32), c_uint32, c_char_p, c_double]
    lib.chefbot_board_get.argtypes = [c_void_p, POINTER(FirmwareState)]
    lib.chefbot_board_turn.argtypes = [c_void_p, c_int32, c_int32]
    lib.chefbot_board_advance.argtypes = [c_void_p, c_uint32]
    for name in ("battery", "cliffs", "driver_fault", "echo", "estop", "imu_answers"):
        getattr(lib, f"chefbot_board_{name}").argtypes = [c_void_p, c_int32]
    for name in ("destroy", "power_cycle"):
        getattr(lib, f"chefbot_board_{name}").argtypes = [c_void_p]
    return lib


def _rebuild_if_stale() -> None:
    """Compile the library if it is missing or was built from other sources."""
    fingerprint = runpy.run_path(str(BUILDER))["fingerprint"]().encode()
    if LIBRARY.exists() and fingerprint in LIBRARY.read_bytes():
        return
    sys.stderr.write("Compiling the motor board's firmware for the simulator: some seconds, once.\n")
    command = [sys.executable, str(BUILDER), str(LIBRARY)]
    result = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    if result.returncode:
        raise UserError(result.stderr.strip())

"""`chefbot board emulate`: the firmware on this computer, at a pseudo-terminal."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

from rich.console import Console

from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.signals import stop_on_signals
from chefbot.sim.firmware import serve
from chefbot.storage.atomic_files import make_folder

console = Console(highlight=False, soft_wrap=True)


def run_emulator(name_or_path: str, link: Path) -> int:
    """Run the firmware at a pseudo-terminal until Ctrl-C; returns its exit code.

    Raises UserError for an invalid robot, a system without pseudo-terminals, or a `link` that is in use.
    """
    robot = load_robot(name_or_path)
    if not hasattr(os, "openpty"):
        raise UserError(
            "a board at a pseudo-terminal can be emulated on Linux and macOS only; `chefbot demo` contains one"
        )
    make_folder(link.parent)
    _check_free(link)
    _detach_from_terminal()
    console.print(
        "A motor board with motor model; its standard input takes faults and inputs: "
        "estop 0|1, block WHEEL 0|1, cable WHEEL 0|1, battery MV, echo US, imu 0|1, hang, power. Its serial port is:"
    )
    sys.stdout.flush()
    return serve(robot, link)


def run_emulated_robot(robot: str, world: str, profile: str, seed: int, board: Path, lidar: Path) -> int:
    """Run the hardware of a simulated robot at two pseudo-terminals until Ctrl-C; returns the exit code.

    Prints a line of JSON about the true state each 0.1 s. Standard input takes `unplug DEVICE` and `plug DEVICE`,
    the device being board or lidar. Raises UserError for invalid input.
    """
    from chefbot.sim.ports.hardware import HardwareOptions, run_hardware  # takes a second
    from chefbot.sim.realism import check_profile

    _check_pseudo_terminals()
    check_profile(profile)
    for link in (board, lidar):
        make_folder(link.parent)
        _check_free(link)
    _detach_from_terminal()
    ended = threading.Event()
    options = HardwareOptions(load_robot(robot), world, profile, seed, board, lidar)
    with stop_on_signals(ended.set):
        run_hardware(options, ended, _print_line)
    return 0


def _check_pseudo_terminals() -> None:
    if not hasattr(os, "openpty"):
        raise UserError(
            "serial ports can be emulated on Linux and macOS only; `chefbot demo --bytes` needs none"
        )


def _print_line(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _check_free(link: Path) -> None:
    """Raise UserError if `link` exists; a dangling link of a board that was killed is replaced."""
    if not link.exists():
        return
    if not link.is_symlink():
        raise UserError(f"{link} exists already and is not a link; choose another --link")
    raise UserError(
        f"{link} leads to {link.resolve()}, where another board may be: end it, remove the link, or choose "
        "another --link"
    )


def _detach_from_terminal() -> None:
    """Redirect the standard input of a background process: reading the terminal would suspend it."""
    if sys.stdin is not None and sys.stdin.isatty() and os.tcgetpgrp(0) != os.getpgrp():
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)

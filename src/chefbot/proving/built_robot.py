"""A built robot on emulated hardware: the programs of the robot know two serial ports, as on a real one.

The hardware (firmware, lidar, physics) is one process; the launch of the robot has its own, without the simulator.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.proving.simulated_run import TaskFailedError
from chefbot.sim.ports.hardware import TrueState
from chefbot.ui.remote.web_ui_client import ConnectionLostError, WebUiClient

START_TIMEOUT, STOP_TIMEOUT = 90.0, 30.0
"""Time for programs to start and to end, s."""
CHEFBOT = (sys.executable, "-m", "chefbot")


class BuiltSetup(NamedTuple):
    """What is built and where: names of the robot and the world, profile, seed, people, and the folder of the run."""

    robot: str
    world: str
    profile: str
    seed: int
    folder: Path


class HardwareProcess:
    """The emulated hardware; `states` are the true states so far."""

    def __init__(self, setup: BuiltSetup) -> None:
        self.board, self.lidar = setup.folder / "board", setup.folder / "lidar"
        options = ["--robot", setup.robot, "--world", setup.world, "--profile", setup.profile]
        options += ["--seed", str(setup.seed), "--link", str(self.board), "--lidar", str(self.lidar)]
        self.states: list[TrueState] = []
        self._errors = (setup.folder / "hardware.log").open("w")
        self._process = subprocess.Popen(
            [*CHEFBOT, "board", "emulate", *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )
        self._thread = threading.Thread(target=self._read, name="true states", daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.states.append(TrueState(**json.loads(line)))

    @property
    def newest(self) -> TrueState:
        """The newest true state. Raises TaskFailedError if the hardware has ended."""
        if self._process.poll() is not None:
            raise TaskFailedError("the emulated hardware has ended, see hardware.log")
        return self.states[-1]

    @property
    def pose(self) -> SE2:
        """The newest true pose, from the robot's start."""
        return SE2(*self.newest.pose)

    def wait(self, condition: Callable[[], bool], what: str, limit: float) -> None:
        """Wait until a condition holds. Raises TaskFailedError after `limit` s of wall time."""
        deadline = time.monotonic() + limit
        while not condition():
            if time.monotonic() > deadline:
                raise TaskFailedError(f"{what} after {limit:.0f} s")
            if self._process.poll() is not None:
                raise TaskFailedError("the emulated hardware has ended, see hardware.log")
            time.sleep(0.1)

    def request(self, line: str) -> None:
        """Send a request, such as `unplug lidar`."""
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def stands(self, seconds: float) -> bool:
        """Return whether the robot has not moved for so many seconds of the hardware's time."""
        now = self.newest
        since = [
            state for state in self.states[-int(20 * seconds) - 20 :] if state.time >= now.time - seconds
        ]
        poses = [SE2(*state.pose) for state in since]
        still = all(pose.distance(poses[-1]) < 0.01 for pose in poses)
        return still and now.time - since[0].time > 0.8 * seconds

    def close(self) -> None:
        """End the process of the emulated hardware."""
        end_process(self._process)
        self._thread.join(STOP_TIMEOUT)
        self._errors.close()


class RobotProcess:
    """A launch of the built robot with its web UI at `url`."""

    def __init__(self, setup: BuiltSetup, hardware: HardwareProcess, launch: str, *arguments: str) -> None:
        port = free_port()
        self.url = f"http://127.0.0.1:{port}"
        given = [*_launch_arguments(setup, hardware), f"port:={port}", *arguments]
        self._environment = {**os.environ, "XDG_STATE_HOME": str(setup.folder / "state")}
        self._output = (setup.folder / f"{launch}.log").open("w")
        self._process = subprocess.Popen(
            [*CHEFBOT, "launch", launch, *given],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            env=self._environment,
        )

    @property
    def pid(self) -> int:
        """The process of the launch, which has others as children."""
        return self._process.pid

    def page(self) -> WebUiClient:
        """Connect to the web UI. Raises TaskFailedError if the robot does not start."""
        deadline = time.monotonic() + START_TIMEOUT
        while True:
            try:
                return WebUiClient(self.url)
            except UserError as error:
                if self._process.poll() is not None or time.monotonic() > deadline:
                    raise TaskFailedError(f"the robot does not start: {error}") from None
                time.sleep(0.5)

    def layer(self, name: str, timeout: float = START_TIMEOUT) -> Any:
        """Return what the web UI shows as a layer. Raises TaskFailedError if it shows nothing."""
        with self.page() as page:
            try:
                value = page.wait_for(name, timeout)
            except ConnectionLostError as error:
                raise TaskFailedError(str(error)) from None
        if value is None:
            raise TaskFailedError(f"the robot shows no {name} after {timeout:.0f} s")
        return value

    def command(self, group: str, verb: str, *arguments: str) -> None:
        """Run a command of chefbot for this robot. Raises TaskFailedError with its message if it fails."""
        done = subprocess.run(
            [*CHEFBOT, group, verb, "--page", self.url, *arguments],
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise TaskFailedError(f"chefbot {group} {verb}: {(done.stdout + done.stderr).strip()}")

    def close(self) -> None:
        """End the launch as Ctrl-C does."""
        end_process(self._process)
        self._output.close()


def _launch_arguments(setup: BuiltSetup, hardware: HardwareProcess) -> list[str]:
    # one process, as several runs share a machine
    return [
        "built:=true",
        "wire:=off",
        f"robot:={setup.robot}",
        f"seed:={setup.seed}",
        f"board_port:={hardware.board}",
        f"lidar_port:={hardware.lidar}",
    ]


def end_process(process: subprocess.Popen[Any]) -> None:
    """End a process by SIGINT, or by force if it does not end."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdin is not None:
        process.stdin.close()


def free_port() -> int:
    """Return a TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])

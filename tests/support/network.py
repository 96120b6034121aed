"""Several machines for tests: network namespaces on one bridge, each with its own loopback, keys and programs."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from chefbot.fleet.keyring import Keyring
from tests.support.waiting import PATIENCE

MACHINE, REPOSITORY = Path(__file__).parent / "machine.py", Path(__file__).parents[2]
needs_namespaces = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("ip") is None,
    reason="needs root and iproute2 for network namespaces",
)


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


class Machine:
    """A program in a namespace of its own that answers lines with lines of JSON, the first without being asked."""

    def __init__(self, command: list[str]) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY
        )
        self.state = self.answer()

    def tell(self, line: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def ask(self, line: str) -> object:
        self.tell(line)
        return self.answer()

    def until(self, line: str, wanted: Callable[[object], bool]) -> object:
        """Ask again until the answer is as wanted; fails after PATIENCE."""
        end = time.monotonic() + PATIENCE
        while not wanted(found := self.ask(line)):
            assert time.monotonic() < end, f"{line}: {found}"
            time.sleep(0.1)
        return found

    def stop(self) -> None:
        self._process.communicate(timeout=PATIENCE)

    def answer(self) -> object:
        """The next line."""
        assert self._process.stdout
        return json.loads(self._process.stdout.readline())


def end(process: subprocess.Popen[str]) -> str:
    """What it had to say, if it has a pipe; killed where it does not end."""
    if process.returncode is not None:
        return ""  # it was heard to its end before
    try:
        return process.communicate(timeout=PATIENCE)[0] or ""
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise


class Network:
    """A bridge, and namespaces with one address each."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._tag = folder, f"cb{os.getpid() % 100000}"
        self._places: list[str] = []
        self._running: list[Machine] = []
        self._programs: list[subprocess.Popen[str]] = []
        ip("link", "add", self._tag, "type", "bridge")
        ip("link", "set", self._tag, "up")

    def start(self, name: str, *join: str) -> Machine:
        """A machine with the keys in folder NAME."""
        return self._ask(
            [*self._in(name), sys.executable, str(MACHINE), name, str(self._folder / name), *join]
        )

    def page_user(self, name: str, port: int = 8080) -> Machine:
        """Somebody at the page that is served on a machine."""
        return self._ask([*self._in(name), sys.executable, "-m", "tests.support.web_ui_user", str(port)])

    def chefbot(self, name: str, *words: str, **how: Any) -> subprocess.Popen[str]:
        """`chefbot ...` on a machine with the keys in folder NAME; ended with the test."""
        own = {"CHEFBOT_KEYS": str(self._folder / name), "ROS_DOMAIN_ID": "0", "CHEFBOT_WIRE_PORT": "7447"}
        command = [*self._in(name), sys.executable, "-m", "chefbot", *words]
        pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        process = subprocess.Popen(command, env={**os.environ, **own}, **{**pipes, **how})
        self._programs.append(process)
        return process

    def link(self, name: str, state: str) -> None:
        """Cut a machine off by `down`, and join it again by `up`."""
        ip("link", "set", f"{self._tag}v{self._places.index(self._place(name)) + 1}", state)

    def address(self, name: str) -> str:
        return f"10.199.7.{self._places.index(self._place(name)) + 1}"

    def close(self) -> None:
        for machine in self._running:
            machine.stop()
        for process in self._programs:
            process.send_signal(signal.SIGINT)
        for process in self._programs:
            sys.stdout.write(f"--- {process.args}\n{end(process)}")  # shown where a test fails
        for place in self._places:
            ip("netns", "del", place)
        ip("link", "del", self._tag)

    def _ask(self, command: list[str]) -> Machine:
        machine = Machine(command)
        self._running.append(machine)
        return machine

    def _in(self, name: str) -> list[str]:
        return ["ip", "netns", "exec", self._place(name)]

    def _place(self, name: str) -> str:
        place = f"{self._tag}{name}"
        if place not in self._places:
            self._places.append(place)
            number = len(self._places)
            ip("netns", "add", place)
            ip("link", "add", f"{self._tag}v{number}", "type", "veth", "peer", "name", "eth0", "netns", place)
            ip("link", "set", f"{self._tag}v{number}", "master", self._tag, "up")
            ip("-n", place, "addr", "add", f"10.199.7.{number}/24", "dev", "eth0")
            ip("-n", place, "link", "set", "eth0", "up")
            ip("-n", place, "link", "set", "lo", "up")
        return place


def admit(folder: Path, office: Keyring, name: str, role: str) -> None:
    ring, now = Keyring(folder / name), datetime.now(UTC)
    ring.accept(office.admit(ring.request_membership(name, role), now)[0])  # type: ignore[arg-type]

"""Simulates several machines by network namespaces on one bridge, each with its own loopback, keys and programs."""

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
from chefbot.fleet.membership import Role
from tests.support.waiting import PATIENCE

MACHINE, REPOSITORY = Path(__file__).parent / "fleet_machine.py", Path(__file__).parents[2]
needs_namespaces = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("ip") is None,
    reason="needs root and iproute2 for network namespaces",
)


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True)


class Machine:
    """A program in a network namespace that answers lines with lines of JSON and sends one when it is ready."""

    def __init__(self, command: list[str]) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY
        )
        self.state = self.answer()

    def send(self, line: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def request(self, line: str) -> object:
        self.send(line)
        return self.answer()

    def until(self, line: str, condition: Callable[[object], bool]) -> object:
        """Repeat a request until its answer meets the condition; AssertionError after PATIENCE."""
        end = time.monotonic() + PATIENCE
        while not condition(found := self.request(line)):
            assert time.monotonic() < end, f"{line}: {found}"
            time.sleep(0.1)
        return found

    def stop(self) -> None:
        self._process.communicate(timeout=PATIENCE)

    def answer(self) -> object:
        """Return the next answer."""
        assert self._process.stdout
        return json.loads(self._process.stdout.readline())


def end(process: subprocess.Popen[str]) -> str:
    """Return the output of a process when it has ended; kill it if it does not end in time."""
    if process.returncode is not None:
        return ""  # the output was read before
    try:
        return process.communicate(timeout=PATIENCE)[0] or ""
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise


class Network:
    """A network bridge, and namespaces with one address each.

    The bridge has a namespace of its own: a browser that tests beside this one would give up its requests whenever a
    link appears in the network of the computer itself.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._tag = folder, f"cb{os.getpid() % 100000}"
        self._namespaces: list[str] = []
        self._running: list[Machine] = []
        self._programs: list[subprocess.Popen[str]] = []
        self._hub = f"{self._tag}hub"
        ip("netns", "add", self._hub)
        ip("-n", self._hub, "link", "add", "bridge", "type", "bridge")
        ip("-n", self._hub, "link", "set", "bridge", "up")

    def start(self, name: str, *join: str) -> Machine:
        """Start a machine with the keys in the folder of that name."""
        return self._start(
            [*self._in(name), sys.executable, str(MACHINE), name, str(self._folder / name), *join]
        )

    def page_user(self, name: str, port: int = 8080) -> Machine:
        """Start a program that uses the web UI which is served on a machine."""
        return self._start([*self._in(name), sys.executable, "-m", "tests.support.web_ui_user", str(port)])

    def chefbot(self, name: str, *arguments: str, **options: Any) -> subprocess.Popen[str]:
        """Start `chefbot` on a machine with the keys in the folder of that name; it is ended with the test."""
        environment = {
            "CHEFBOT_KEYS": str(self._folder / name),
            "ROS_DOMAIN_ID": "0",
            "CHEFBOT_WIRE_PORT": "7447",
        }
        command = [*self._in(name), sys.executable, "-m", "chefbot", *arguments]
        pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        process = subprocess.Popen(command, env={**os.environ, **environment}, **{**pipes, **options})
        self._programs.append(process)
        return process

    def link(self, name: str, state: str) -> None:
        """Set the state of a machine's link, `down` or `up`."""
        ip("-n", self._hub, "link", "set", f"v{self._namespaces.index(self._namespace(name)) + 1}", state)

    def address(self, name: str) -> str:
        return f"10.199.7.{self._namespaces.index(self._namespace(name)) + 1}"

    def close(self) -> None:
        for machine in self._running:
            machine.stop()
        for process in self._programs:
            process.send_signal(signal.SIGINT)
        for process in self._programs:
            sys.stdout.write(f"--- {process.args}\n{end(process)}")  # pytest shows it if the test fails
        for namespace in self._namespaces:
            ip("netns", "del", namespace)
        ip("netns", "del", self._hub)

    def _start(self, command: list[str]) -> Machine:
        machine = Machine(command)
        self._running.append(machine)
        return machine

    def _in(self, name: str) -> list[str]:
        return ["ip", "netns", "exec", self._namespace(name)]

    def _namespace(self, name: str) -> str:
        namespace = f"{self._tag}{name}"
        if namespace not in self._namespaces:
            self._namespaces.append(namespace)
            number = len(self._namespaces)
            veth = ("type", "veth", "peer", "name", "eth0", "netns", namespace)
            ip("netns", "add", namespace)
            ip("-n", self._hub, "link", "add", f"v{number}", *veth)
            ip("-n", self._hub, "link", "set", f"v{number}", "master", "bridge", "up")
            ip("-n", namespace, "addr", "add", f"10.199.7.{number}/24", "dev", "eth0")
            ip("-n", namespace, "link", "set", "eth0", "up")
            ip("-n", namespace, "link", "set", "lo", "up")
        return namespace


def admit(folder: Path, office: Keyring, name: str, role: Role, now: datetime | None = None) -> Keyring:
    """Make a member with keys in the folder of its name, signed at the time `now`."""
    ring = Keyring(folder / name)
    ring.accept(office.admit(ring.request_membership(name), now or datetime.now(UTC), role)[0])
    return ring

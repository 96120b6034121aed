"""Several machines: network namespaces joined by a bridge, each with its own loopback, keys and programs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from chefbot.wire.keyring import Keyring

MACHINE = Path(__file__).parent / "machine.py"
PATIENCE = 60.0
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        os.geteuid() != 0 or shutil.which("ip") is None,
        reason="needs root and iproute2 for network namespaces",
    ),
]


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


class Machine:
    """Programs in a namespace of their own."""

    def __init__(self, place: str, name: str, keys: Path, join: tuple[str, ...]) -> None:
        command = ["ip", "netns", "exec", place, sys.executable, str(MACHINE), name, str(keys), *join]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.state = self._answer()

    def tell(self, line: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def ask(self, line: str) -> object:
        self.tell(line)
        return self._answer()

    def until(self, line: str, wanted: Callable[[object], bool]) -> object:
        """Ask again until the answer is as wanted; fails after PATIENCE."""
        end = time.monotonic() + PATIENCE
        while not wanted(found := self.ask(line)):
            assert time.monotonic() < end, f"{line}: {found}"
            time.sleep(0.1)
        return found

    def stop(self) -> None:
        self._process.communicate(timeout=PATIENCE)

    def _answer(self) -> object:
        assert self._process.stdout
        return json.loads(self._process.stdout.readline())


class Network:
    """A bridge, and namespaces with one address each."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._tag = folder, f"cb{os.getpid() % 100000}"
        self._places: list[str] = []
        self._running: list[Machine] = []
        ip("link", "add", self._tag, "type", "bridge")
        ip("link", "set", self._tag, "up")

    def start(self, name: str, *join: str) -> Machine:
        """A machine with the keys in folder NAME."""
        machine = Machine(self._place(name), name, self._folder / name, join)
        self._running.append(machine)
        return machine

    def address(self, name: str) -> str:
        return f"10.199.7.{self._places.index(self._place(name)) + 1}"

    def close(self) -> None:
        for machine in self._running:
            machine.stop()
        for place in self._places:
            ip("netns", "del", place)
        ip("link", "del", self._tag)

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


@pytest.fixture
def network(tmp_path: Path) -> Iterator[Network]:
    try:
        one = Network(tmp_path)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no network namespaces here: {error.stderr.strip()}")
    yield one
    one.close()


def admit(folder: Path, office: Keyring, name: str, role: str) -> None:
    ring, now = Keyring(folder / name), datetime.now(UTC)
    ring.accept(office.sign(ring.ask(name, role), now)[0])  # type: ignore[arg-type]


@pytest.fixture
def fleet(tmp_path: Path) -> Keyring:
    """Two robots and an operator, who all know each other."""
    office = Keyring(tmp_path / "site")
    office.found("hotel", datetime.now(UTC))
    members = {"robot1": "robot", "robot2": "robot", "alice": "operator"}
    for name, role in members.items():
        admit(tmp_path, office, name, role)
    for name in members:
        Keyring(tmp_path / name).accept(office.card())
    return office


def says_until(speaker: Machine, words: str, witness: Machine, line: str, wanted: str) -> None:
    """Publish until the witness answers as wanted: who speaks before the listener is known is not heard."""

    def seen(found: object) -> bool:
        speaker.tell(f"say {words}")
        return wanted in str(found)

    witness.until(line, seen)


def test_an_operator_drives_and_a_robot_cannot_drive_another(network: Network, fleet: Keyring) -> None:
    robot1 = network.start("robot1")
    there = f"tls/{network.address('robot1')}:7447"
    assert robot1.ask("listens") == [there]
    alice, robot2 = network.start("alice", there), network.start("robot2", there)
    robot1.tell("hear /robot1/cmd_vel")
    alice.tell("hear /robot1/odom")
    robot2.tell("hear /robot1/odom")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found))
    says_until(alice, "/robot1/cmd_vel from_alice", robot1, "heard", "from_alice")
    says_until(robot1, "/robot1/odom here", alice, "heard", "here")
    says_until(
        robot2, "/robot1/cmd_vel from_robot2", robot1, "refused", "robot2 may not write 0/robot1/cmd_vel"
    )
    assert "robot2" not in str(robot1.ask("heard"))
    assert robot2.ask("heard") == []


def test_who_joins_before_the_robot_is_there_meets_it_later(network: Network, fleet: Keyring) -> None:
    alice = network.start("alice", f"tls/{network.address('robot1')}:7447")
    assert alice.ask("nodes") == ["/alice/tester"]
    network.start("robot1")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found))


def test_over_the_site_robots_and_operators_meet(network: Network, fleet: Keyring) -> None:
    site = network.start("site")
    there = f"tls/{network.address('site')}"
    robot1, robot2, alice = (network.start(name, f"{there}:7447") for name in ("robot1", "robot2", "alice"))
    robot1.tell("hear /robot1/cmd_vel")
    alice.tell("hear /robot1/odom")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found) and "/robot2/tester" in str(found))
    says_until(alice, "/robot1/cmd_vel from_alice", robot1, "heard", "from_alice")
    says_until(robot1, "/robot1/odom here", alice, "heard", "here")
    says_until(
        robot2, "/robot1/cmd_vel from_robot2", site, "refused", "robot2 may not write 0/robot1/cmd_vel"
    )
    assert "robot2" not in str(robot1.ask("heard"))


def test_strangers_and_former_members_stay_outside(network: Network, fleet: Keyring, tmp_path: Path) -> None:
    foreign = Keyring(tmp_path / "foreign")
    foreign.found("thieves", datetime.now(UTC))
    Keyring(tmp_path / "robot1").accept(fleet.remove("robot2"))
    robot1 = network.start("robot1")
    there = f"tls/{network.address('robot1')}:7447"
    stranger, former = network.start("foreign", there), network.start("robot2", there)
    robot1.tell("hear /robot2/odom")
    former.tell("say /robot2/odom lost")
    robot1.until("refused", lambda found: "robot2 is not on the fleet's list" in str(found))
    robot1.until("refused", lambda found: "a stranger was turned away" in str(found))
    assert robot1.ask("heard") == [] and "/robot1/tester" not in str(stranger.ask("nodes"))
    assert "/robot1/tester" not in str(former.ask("nodes"))
    refused = network.start("nobody", there)
    assert "TLS needs this machine to be a member" in str(refused.state)

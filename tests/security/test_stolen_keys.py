"""Stolen, replaced and expired keys at the routers of real machines."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from tests.support.fleet_machine import UNCHECKED
from tests.support.network import Machine, Network, admit, needs_namespaces

from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Card

pytestmark = [pytest.mark.slow, needs_namespaces]
TOPIC = "/robot2/odom"


def stolen(folder: Path, name: str = "robot2") -> None:
    """Copy a member's keys for another machine, `thief`."""
    shutil.copytree(folder / name, folder / "thief")


def card_file(folder: Path, card: Card) -> Path:
    path = folder / "some.card"
    path.write_bytes(msgspec.json.encode(card))
    return path


def replaced(folder: Path, office: Keyring) -> Keyring:
    """Remove robot2 and admit another machine of the same name."""
    office.remove("robot2")
    shutil.rmtree(folder / "robot2")
    return admit(folder, office, "robot2", "robot")


def publish_both_until(site: Machine, thief: Machine, robot: Machine, expected: set[str]) -> list[str]:
    """Publish from both machines until the site has received all `expected`; return what came last."""

    def seen(received: object) -> bool:
        thief.send(f"publish {TOPIC} from_thief")
        robot.send(f"publish {TOPIC} from_robot")
        return expected <= {data for _, data in received}  # type: ignore[attr-defined]

    return [data for _, data in site.until("received", seen)]  # type: ignore[attr-defined]


def test_a_stolen_key_stays_out_after_a_replacement(network: Network, fleet: Keyring, tmp_path: Path) -> None:
    stolen(tmp_path)
    replaced(tmp_path, fleet)
    site = network.start("site")
    there = f"tls/{network.address('site')}:7447"
    thief, robot = network.start("thief", there, UNCHECKED), network.start("robot2", there)
    site.send(f"subscribe {TOPIC}")
    site.until("errors", lambda found: "a removed or replaced certificate of robot2" in str(found))
    received = publish_both_until(site, thief, robot, {"from_robot"})
    received += publish_both_until(site, thief, robot, {"from_robot"})
    assert "from_thief" not in received
    assert "/site/tester" not in str(thief.request("nodes"))


@pytest.mark.rotated("lists and certificates of a fleet")
def test_running_routers_take_over_a_new_list(network: Network, fleet: Keyring, tmp_path: Path) -> None:
    """A stolen key works until the list without it is accepted, then no more, without a restart of the launch."""
    stolen(tmp_path)
    site = network.start("site")
    there = f"tls/{network.address('site')}:7447"
    thief, robot = network.start("thief", there), network.start("robot2", there)
    site.send(f"subscribe {TOPIC}")
    publish_both_until(site, thief, robot, {"from_robot", "from_thief"})
    routers = {machine: machine.request("router") for machine in (site, robot)}

    request = Keyring(tmp_path / "robot2").renew(datetime.now(UTC))
    assert request is not None
    card = card_file(
        tmp_path, fleet.admit(request, datetime.now(UTC), replace=True)[0]
    )  # the site has the list
    robot.request(f"accept {card}")
    for machine, former in routers.items():
        machine.until("router", lambda current, former=former: current != former)
    site.until("errors", lambda found: "a removed or replaced certificate of robot2" in str(found))
    before = len(site.request("received"))  # type: ignore[arg-type]

    def robot_is_back(received: object) -> bool:
        thief.send(f"publish {TOPIC} from_thief")
        robot.send(f"publish {TOPIC} renewed")
        return [data for _, data in received][-3:] == ["renewed"] * 3  # type: ignore[attr-defined]

    after = site.until("received", robot_is_back)
    assert {data for _, data in after[before:]} <= {"renewed", "from_robot"}  # type: ignore[index]


@pytest.mark.rotated("lists and certificates of a fleet")
def test_an_old_list_accepts_what_a_new_one_refuses(network: Network, fleet: Keyring, tmp_path: Path) -> None:
    """A machine that has not accepted the new list still accepts the stolen key and refuses its replacement."""
    stolen(tmp_path)
    replaced(tmp_path, fleet)
    alice = network.start("alice")
    there = f"tls/{network.address('alice')}:7447"
    thief, robot = network.start("thief", there), network.start("robot2", there)
    alice.send(f"subscribe {TOPIC}")
    assert "from_robot" not in publish_both_until(alice, thief, robot, {"from_thief"})
    alice.until("errors", lambda found: "a removed or replaced certificate of robot2" in str(found))
    alice.request(f"accept {card_file(tmp_path, fleet.card())}")
    publish_both_until(alice, thief, robot, {"from_robot"})


@pytest.mark.rotated("lists and certificates of a fleet")
def test_an_expired_certificate_is_refused_at_both_ends(network: Network, tmp_path: Path) -> None:
    now, year = datetime.now(UTC), timedelta(days=365)
    office = Keyring(tmp_path / "site")
    office.create_fleet("hotel", now - 2 * year)
    office.renew(now)
    admit(tmp_path, office, "robot2", "robot", now - year - timedelta(hours=1))
    site = network.start("site")
    there = f"tls/{network.address('site')}:7447"
    refused = network.start("robot2", there)
    assert "the certificate of robot2 expired on" in str(refused.state)
    shutil.copytree(tmp_path / "robot2", tmp_path / "thief")
    thief = network.start("thief", there, UNCHECKED)
    site.send(f"subscribe {TOPIC}")
    thief.send(f"publish {TOPIC} from_thief")
    site.until("errors", lambda found: "expired" in str(found).lower())
    assert site.request("received") == [] and "/site/tester" not in str(thief.request("nodes"))


@pytest.mark.rotated("lists and certificates of a fleet")
def test_a_connection_ends_when_its_certificate_expires(network: Network, tmp_path: Path) -> None:
    """The other members are for a machine with so much load that the first is not connected in time."""
    now, year = datetime.now(UTC), timedelta(days=365)
    office = Keyring(tmp_path / "site")
    office.create_fleet("hotel", now - 2 * year)
    office.renew(now)
    site = network.start("site")
    there = f"tls/{network.address('site')}:7447"
    for name, validity in (("robot2", 8), ("robot3", 20), ("robot4", 60), ("robot5", 250)):
        ends = datetime.now(UTC) + timedelta(seconds=validity)
        admit(tmp_path, office, name, "robot", ends - year)
        site.request(f"accept {card_file(tmp_path, office.card())}")
        robot = network.start(name, there)
        if robot.state == "ready" and is_connected_before(robot, ends):
            robot.until("nodes", lambda found: "/site/tester" not in str(found))
            assert datetime.now(UTC) >= ends - timedelta(seconds=1)
            return
    pytest.fail("no member was connected before its certificate expired")


def is_connected_before(robot: Machine, ends: datetime) -> bool:
    robot.until("nodes", lambda found: "/site/tester" in str(found) or datetime.now(UTC) >= ends)
    return datetime.now(UTC) < ends


@pytest.mark.parametrize("role", ["robot", "operator"])
def test_the_role_of_the_signer_holds_at_the_wire(
    role: str, network: Network, fleet: Keyring, tmp_path: Path
) -> None:
    admit(tmp_path, fleet, "bob", role)  # type: ignore[arg-type]
    Keyring(tmp_path / "robot1").accept(fleet.card())
    robot1 = network.start("robot1")
    bob = network.start("bob", f"tls/{network.address('robot1')}:7447")
    robot1.send("subscribe /robot1/cmd_vel")

    def answered(found: object) -> bool:
        bob.send("publish /robot1/cmd_vel from_bob")
        return "from_bob" in str(found) or "bob may not write 0/robot1/cmd_vel" in str(found)

    robot1.until("received" if role == "operator" else "errors", answered)
    assert ("from_bob" in str(robot1.request("received"))) == (role == "operator")

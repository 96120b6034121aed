"""Several machines: which receive what over their gates."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from tests.support.network import Machine, Network, needs_namespaces

from chefbot.fleet.keyring import Keyring

pytestmark = [pytest.mark.slow, needs_namespaces]


def publish_until(publisher: Machine, message: str, witness: Machine, line: str, expected: str) -> None:
    """Publish again until the witness has the expected answer, as messages before discovery are lost."""

    def seen(found: object) -> bool:
        publisher.send(f"publish {message}")
        return expected in str(found)

    witness.until(line, seen)


def test_an_operator_drives_and_another_robot_cannot(network: Network, fleet: Keyring) -> None:
    robot1 = network.start("robot1")
    there = f"tls/{network.address('robot1')}:7447"
    assert robot1.request("endpoints") == [there]
    alice, robot2 = network.start("alice", there), network.start("robot2", there)
    robot1.send("subscribe /robot1/cmd_vel")
    alice.send("subscribe /robot1/odom")
    robot2.send("subscribe /robot1/odom")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found))
    publish_until(alice, "/robot1/cmd_vel from_alice", robot1, "received", "from_alice")
    publish_until(robot1, "/robot1/odom here", alice, "received", "here")
    publish_until(
        robot2, "/robot1/cmd_vel from_robot2", robot1, "errors", "robot2 may not write 0/robot1/cmd_vel"
    )
    assert "robot2" not in str(robot1.request("received"))
    assert robot2.request("received") == []


def test_an_operator_who_joins_first_meets_the_robot_later(network: Network, fleet: Keyring) -> None:
    alice = network.start("alice", f"tls/{network.address('robot1')}:7447")
    assert alice.request("nodes") == ["/alice/tester"]
    network.start("robot1")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found))


def test_robots_and_operators_connect_over_the_site_router(network: Network, fleet: Keyring) -> None:
    site = network.start("site")
    there = f"tls/{network.address('site')}"
    robot1, robot2, alice = (network.start(name, f"{there}:7447") for name in ("robot1", "robot2", "alice"))
    robot1.send("subscribe /robot1/cmd_vel")
    alice.send("subscribe /robot1/odom")
    alice.until("nodes", lambda found: "/robot1/tester" in str(found) and "/robot2/tester" in str(found))
    publish_until(alice, "/robot1/cmd_vel from_alice", robot1, "received", "from_alice")
    publish_until(robot1, "/robot1/odom here", alice, "received", "here")
    publish_until(
        robot2, "/robot1/cmd_vel from_robot2", site, "errors", "robot2 may not write 0/robot1/cmd_vel"
    )
    assert "robot2" not in str(robot1.request("received"))


def test_strangers_and_former_members_are_rejected(network: Network, fleet: Keyring, tmp_path: Path) -> None:
    foreign = Keyring(tmp_path / "foreign")
    foreign.create_fleet("thieves", datetime.now(UTC))
    Keyring(tmp_path / "robot1").accept(fleet.remove("robot2"))
    robot1 = network.start("robot1")
    there = f"tls/{network.address('robot1')}:7447"
    stranger, former = network.start("foreign", there), network.start("robot2", there)
    robot1.send("subscribe /robot2/odom")
    former.send("publish /robot2/odom lost")
    robot1.until("errors", lambda found: "robot2 is not on the fleet's list" in str(found))
    robot1.until("errors", lambda found: "an unknown peer was rejected" in str(found))
    assert robot1.request("received") == [] and "/robot1/tester" not in str(stranger.request("nodes"))
    assert "/robot1/tester" not in str(former.request("nodes"))
    refused = network.start("nobody", there)
    assert "TLS needs this machine to be a member" in str(refused.state)

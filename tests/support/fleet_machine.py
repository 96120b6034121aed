"""A machine of a fleet with its own router, controlled by lines on standard input.

subscribe TOPIC       subscribe to a String topic
publish TOPIC TEXT    publish once
accept CARD           accept a card file while the router runs
received | nodes | errors | endpoints | router     answered with a line of JSON; `router` is the id of its process
"""

from __future__ import annotations

import json
import sys
from datetime import datetime
from pathlib import Path

from chefbot.errors import UserError
from chefbot.fleet.identity import Identity
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import read_card
from chefbot.fleet.secure_router import ExternalEndpoints, SecureRouter
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

UNCHECKED = "--unchecked"
"""Argument of a machine that does not check its own certificate, as an attacker's does not."""


class UncheckedKeyring(Keyring):
    """A key folder whose certificate is used although others refuse it."""

    def credentials(self, _now: datetime) -> Identity:
        return self.identity()


def main(name: str, keys: str, *options: str) -> None:
    join = tuple(option for option in options if option != UNCHECKED)
    ring = (UncheckedKeyring if UNCHECKED in options else Keyring)(Path(keys))
    received: list[list[str]] = []
    with RmwContext() as wire, RmwNode(wire, "tester", f"/{name}") as tester:
        gate = SecureRouter(ring if ring.is_member else None, ExternalEndpoints(join))
        answer("ready")
        publishers = {}
        for line in sys.stdin:
            verb, *arguments = line.split()
            if verb == "subscribe":
                tester.subscription(
                    arguments[0],
                    String,
                    lambda message, topic=arguments[0]: received.append([topic, message.data]),
                )
            elif verb == "publish":
                if arguments[0] not in publishers:
                    publishers[arguments[0]] = tester.publisher(arguments[0], String)
                publishers[arguments[0]].publish(String(arguments[1]))
            elif verb == "accept":
                answer(ring.accept(read_card(Path(arguments[0]))[0]).number)
            elif verb == "received":
                answer(received)
            elif verb == "nodes":
                wire.graph.refresh()
                answer(sorted(node.full_name for node in wire.graph.nodes()))
            elif verb == "errors":
                answer(gate.errors.counts())
            elif verb == "endpoints":
                answer(gate.listen_endpoints)
            elif verb == "router":
                answer(gate.process_id)
        gate.close()


def answer(value: object) -> None:
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except UserError as error:
        answer(f"refused: {error}")

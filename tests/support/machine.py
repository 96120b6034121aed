"""One machine of a fleet, for tests: its wire and gate, told by its standard input what to do.

hear TOPIC            listen to a String topic
say TOPIC TEXT        publish once
heard | nodes | refused | listens     answered with a line of JSON
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from chefbot.errors import UserError
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.secure_router import ExternalEndpoints, SecureRouter
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext


def main(name: str, keys: str, *join: str) -> None:
    ring = Keyring(Path(keys))
    heard: list[list[str]] = []
    with RmwContext() as wire, RmwNode(wire, "tester", f"/{name}") as node:
        gate = SecureRouter(ring.identity() if ring.is_member else None, ExternalEndpoints(join))
        answer("ready")
        publishers = {}
        for line in sys.stdin:
            verb, *words = line.split()
            if verb == "hear":
                node.subscription(
                    words[0], String, lambda message, topic=words[0]: heard.append([topic, message.data])
                )
            elif verb == "say":
                if words[0] not in publishers:
                    publishers[words[0]] = node.publisher(words[0], String)
                publishers[words[0]].publish(String(words[1]))
            elif verb == "heard":
                answer(heard)
            elif verb == "nodes":
                wire.graph.refresh()
                answer(sorted(one.full_name for one in wire.graph.nodes()))
            elif verb == "refused":
                answer(gate.errors.counts())
            elif verb == "listens":
                answer(gate.listen_endpoints)
        gate.close()


def answer(value: object) -> None:
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except UserError as error:
        answer(f"refused: {error}")

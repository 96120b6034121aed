"""The secure router of a machine: its only link to other machines, over TLS, for fleet members only.

It is a Zenoh router in a process of its own, between the machine's router on loopback and the others. So what
unknown peers send is decrypted, checked and rejected outside the process that controls the robot, and
programs of this machine, those of ROS 2 too, need neither keys nor rules.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Collection
from contextlib import suppress
from datetime import UTC, datetime
from typing import IO, Any, NamedTuple

import msgspec

from chefbot.errors import UserError
from chefbot.fleet.access_control import access_control
from chefbot.fleet.addresses import addresses
from chefbot.fleet.certificates import split_common_name
from chefbot.fleet.identity import Identity
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Fleet
from chefbot.fleet.membership_watch import MembershipWatch
from chefbot.fleet.router_process import FAILED, OPEN
from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.session import LOOPBACK, PORT

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_ENDPOINT = re.compile(r"(tls|tcp)/(\[[0-9a-fA-F:]+\]|[A-Za-z0-9._-]+)(?::(\d{1,5}))?")
_REJECTED = re.compile(r"CertCommonName\(([^)]*)\)\S* is unauthorized to Put \(ingress\) on (\S+)")
_ACCEPTED = re.compile(r"Accepted TLS connection .*Common Name: (.*)\.$")
_DATA = re.compile(r"(\d+/\S+?)/[^/]+::dds_::[^/]+/.*")
_NODE = re.compile(r"@ros2_lv/(?:[^/]+/){6}([^/]+)/([^/]+)(?:/.*)?")
_UNKNOWN_PEER = re.compile(r"WARN .*zenoh_link_tls::unicast: (.*?)\.? Hint")
LOG_FILTER = "error,zenoh_link_tls=debug,zenoh::net::routing::interceptor=trace"
"""Log filter of the router's process, in the syntax of RUST_LOG."""
POLL_PERIOD = 2.0
"""Period of the checks of the machine's addresses and the router's process, s."""
REJOIN_PAUSE = 1.0
"""Time between the end of a router's process and the start of the next one, s.

A Zenoh router recomputes its routing trees at most every 0.1 s, and announces what it knows only to neighbours
that are new in a tree. It numbers routers and uses the number of one that left again: one that joins before the
computation counts as the former neighbour, and never learns of any subscription or node.
"""


def endpoint(text: str) -> str:
    """Return 'tls/robot1' or 'tls/robot1:7447' as a Zenoh endpoint.

    Raises UserError if it begins with neither tls/ nor tcp/.
    """
    match = _ENDPOINT.fullmatch(text)
    if match is None:
        raise UserError(f"{text!r} is not an endpoint; write tls/HOST or tls/HOST:{PORT}")
    protocol, host, port = match.groups()
    return f"{protocol}/{host}:{port or PORT}"


class ExternalEndpoints(NamedTuple):
    """Endpoints that connect this machine with others."""

    join: tuple[str, ...] = ()
    """Endpoints of other machines to connect to."""
    listen: tuple[str, ...] | None = None
    """Endpoints to listen on; None: a fleet member on all its addresses by TLS, other machines on none."""


def router_config(
    me: Identity | None, endpoints: ExternalEndpoints, port: int = PORT, held: Collection[str] = ()
) -> dict[str, Any]:
    """Return the Zenoh configuration of the secure router.

    `held`: endpoints where it listens already. If another launch's router listens on one, that is sufficient.

    Raises UserError where TLS is requested and this machine has no certificate.
    """
    listen = endpoints.listen
    if listen is None:
        all_endpoints = tuple(f"tls/{address}:{port}" for address in addresses()) if me else ()
        listen = tuple(end for end in all_endpoints if end in held or _is_free(end))
    if me is None and any(end.startswith("tls/") for end in (*listen, *endpoints.join)):
        raise UserError("TLS needs this machine to be a member of a fleet; see `chefbot fleet --help`")
    return {
        "mode": "router",
        "listen": {"endpoints": list(listen), "exit_on_failure": False},
        "connect": {
            "endpoints": [f"tcp/{LOOPBACK}:{port}", *endpoints.join],
            "timeout_ms": -1,  # with 0, Zenoh tries once
            "exit_on_failure": False,
            "retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2},
        },
        "scouting": {"delay": 0, "multicast": {"enabled": False}},
        "timestamping": {"enabled": True},
        **({} if me is None else _tls_config(me)),
    }


def _is_free(end: str) -> bool:
    """Return whether no process listens on a TLS endpoint of this machine."""
    host, _, port = end.partition("/")[2].rpartition(":")
    try:
        socket.create_server((host, int(port))).close()
    except OSError:
        return False
    return True


def _tls_config(me: Identity) -> dict[str, Any]:
    tls = {
        "root_ca_certificate": str(me.authority),
        "listen_private_key": str(me.key),
        "listen_certificate": str(me.certificate),
        "connect_private_key": str(me.key),
        "connect_certificate": str(me.certificate),
        "enable_mtls": True,
        "verify_name_on_connect": False,  # access control matches the certificate's name; addresses change
        "close_link_on_expiration": True,  # else a connection outlives the certificate of its other end
    }
    return {
        "transport": {"link": {"tls": tls}},
        "access_control": access_control(me.fleet, me.name),
    }


class SecureRouter:
    """The process of the secure router, restarted when it dies, and when addresses, keys or the list change.

    `ring`: of a member of a fleet; None for a machine without keys. `refused` counts rejected peers and
    messages, by sentence. The process exits with this one, however that exits.
    """

    def __init__(
        self,
        ring: Keyring | None,
        endpoints: ExternalEndpoints,
        port: int = PORT,
        refused: ErrorCounter | None = None,
    ) -> None:
        """Start the router. Raises UserError if it cannot be opened, or others would refuse its certificate."""
        self.errors = ErrorCounter() if refused is None else refused
        if ring is not None:
            ring.credentials(datetime.now(UTC))
        self._membership = None if ring is None else MembershipWatch(ring)
        self._endpoints, self._port = endpoints, port
        self._closing = threading.Event()
        self._config = router_config(self._me, endpoints, port)
        self._process = self._start()
        self._watcher = threading.Thread(target=self._watch, name="gate watcher", daemon=True)
        self._watcher.start()

    @property
    def listen_endpoints(self) -> list[str]:
        """The endpoints that other machines may join."""
        return list(self._config["listen"]["endpoints"])

    @property
    def process_id(self) -> int:
        """The id of the router's process, which changes when it is restarted."""
        return self._process.pid

    @property
    def _me(self) -> Identity | None:
        return None if self._membership is None else self._membership.identity

    def close(self) -> None:
        """Stop the router and its process."""
        self._closing.set()
        self._watcher.join()
        _end(self._process)

    def __enter__(self) -> SecureRouter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "chefbot.fleet.router_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "RUST_LOG": LOG_FILTER},
        )
        assert process.stdin and process.stdout
        process.stdin.write(msgspec.json.encode(self._config).decode() + "\n")
        process.stdin.flush()
        answer = next(
            (line for line in process.stdout if line.startswith((OPEN, FAILED))), "its process ended"
        )
        if not answer.startswith(OPEN):
            _end(process)
            raise UserError(
                f"the router to other machines cannot be opened: {answer.removeprefix(FAILED).strip()}"
            )
        threading.Thread(target=self._read_log, args=(process.stdout,), name="gate log", daemon=True).start()
        return process

    def _watch(self) -> None:
        while not self._closing.wait(POLL_PERIOD):
            has_new_keys = self._membership is not None and self._membership.refresh(self.errors)
            config = router_config(self._me, self._endpoints, self._port, self.listen_endpoints)
            if self._process.poll() is not None or has_new_keys or config != self._config:
                self._config = config
                self._restart()

    def _restart(self) -> None:
        """Replace the process; it is killed, so that all its connections end at once.

        If it closed one after the other, other routers would compute their trees after the first, and again only
        0.1 s later: time in which any router that joins could be taken for this one.
        """
        self._process.kill()
        _end(self._process)
        if self._closing.wait(REJOIN_PAUSE):
            return
        try:
            self._process = self._start()
        except UserError as error:
            self.errors.add(str(error))

    def _read_log(self, lines: IO[str]) -> None:
        """Count the rejections in Zenoh's log: one for each key that a member has no right to."""
        for line in lines:
            if sentence := rejection_sentence(line, self._me.fleet if self._me else Fleet("", 0, {})):
                self.errors.add(sentence)


def rejection_sentence(line: str, fleet: Fleet) -> str | None:
    """Return a sentence for a line of Zenoh's log that reports a rejection, else None."""
    plain = _COLOURS.sub("", line.rstrip())
    if match := _REJECTED.search(plain):
        return _rejected_write(match[1], match[2], fleet)
    if match := _UNKNOWN_PEER.search(plain):
        return f"an unknown peer was rejected: {match[1]}"
    if match := _ACCEPTED.search(plain):
        return _rejected_certificate(match[1], fleet)
    return None


def _rejected_certificate(common_name: str, fleet: Fleet) -> str | None:
    """Return why a member of the authority's has no rights, or None if it has some."""
    certificate = split_common_name(common_name)
    if fleet.is_valid(certificate):
        return None
    if certificate.name in fleet.members:
        return f"a removed or replaced certificate of {certificate.name} was rejected ({certificate.serial})"
    return f"{certificate.name} is not on the fleet's list"


def _rejected_write(common_name: str, key: str, fleet: Fleet) -> str | None:
    """Return a sentence by topic or node instead of by key: one topic has many keys.

    Nodes are not reported where a robot's router only forwards what it knows of operators, or where they are
    tools.
    """
    member = split_common_name(common_name).name
    if match := _DATA.fullmatch(key):
        return f"{member} may not write {match[1]}"
    if match := _NODE.fullmatch(key):
        namespace, name = match[1].replace("%", "/").rstrip("/"), match[2]
        other = fleet.members.get(namespace.partition("/")[2].partition("/")[0])
        if (other is not None and other.role != "robot") or name.startswith("_"):
            return None
        return f"{member} may not announce node {namespace}/{name}"
    return f"{member} may not write {key}"


def _end(process: subprocess.Popen[str]) -> None:
    """Close the process's input, at which it exits; kill it if it does not."""
    assert process.stdin
    with suppress(OSError):
        process.stdin.close()
    try:
        process.wait(timeout=2.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

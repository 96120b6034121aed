"""The gate of a machine: the one way from its wire to other machines, over TLS, for members of its fleet only.

It is a Zenoh router in a process of its own, between the machine's router on loopback and the others. So what
strangers send is decrypted, judged and refused elsewhere than where the robot is controlled, and programs of
this machine, ROS 2's too, need neither keys nor rules.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import IO, Any, NamedTuple

import msgspec

from chefbot.errors import UserError
from chefbot.fleet.access_control import access_control
from chefbot.fleet.addresses import addresses
from chefbot.fleet.keyring import Identity
from chefbot.fleet.router_process import FAILED, OPEN
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.session import LOOPBACK, PORT

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_ENDPOINT = re.compile(r"(tls|tcp)/(\[[0-9a-fA-F:]+\]|[A-Za-z0-9._-]+)(?::(\d{1,5}))?")
_REFUSED = re.compile(r"CertCommonName\(([^)]*)\)\S* is unauthorized to Put \(ingress\) on (\S+)")
_ACCEPTED = re.compile(r"Accepted TLS connection .*Common Name: (.*)\.$")
_DATA = re.compile(r"(\d+/\S+?)/[^/]+::dds_::[^/]+/.*")
_NODE = re.compile(r"@ros2_lv/(?:[^/]+/){6}([^/]+)/([^/]+)(?:/.*)?")
_STRANGER = re.compile(r"WARN .*zenoh_link_tls::unicast: (.*?)\.? Hint")
LOGGED = "error,zenoh_link_tls=debug,zenoh::net::routing::interceptor=trace"
LOOK_PERIOD = 2.0
"""Seconds between two looks at the machine's addresses and at the gate's process."""


def endpoint(text: str) -> str:
    """'tls/robot1' or 'tls/robot1:7447' as Zenoh writes it. UserError if it is neither tls/ nor tcp/."""
    match = _ENDPOINT.fullmatch(text)
    if match is None:
        raise UserError(f"{text!r} is no place on the wire; write tls/HOST or tls/HOST:{PORT}")
    protocol, host, port = match.groups()
    return f"{protocol}/{host}:{port or PORT}"


class Doors(NamedTuple):
    """Which ways lead out of this machine."""

    join: tuple[str, ...] = ()
    """Endpoints of others."""
    listen: tuple[str, ...] | None = None
    """Where others may come in; None: a member of a fleet on all its addresses by TLS, others nowhere."""


def gate_config(
    me: Identity | None, doors: Doors, port: int = PORT, held: Collection[str] = ()
) -> dict[str, Any]:
    """Zenoh's configuration of the gate. UserError where TLS is asked for and this machine has no certificate.

    `held`: endpoints where it listens already. Where another launch's gate does, that one is enough.
    """
    listen = doors.listen
    if listen is None:
        every = tuple(f"tls/{address}:{port}" for address in addresses()) if me else ()
        listen = tuple(end for end in every if end in held or _is_free(end))
    if me is None and any(end.startswith("tls/") for end in (*listen, *doors.join)):
        raise UserError("TLS needs this machine to be a member of a fleet; see `chefbot keys --help`")
    return {
        "mode": "router",
        "listen": {"endpoints": list(listen), "exit_on_failure": False},
        "connect": {
            "endpoints": [f"tcp/{LOOPBACK}:{port}", *doors.join],
            "timeout_ms": -1,  # with 0, Zenoh tries once
            "exit_on_failure": False,
            "retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2},
        },
        "scouting": {"delay": 0, "multicast": {"enabled": False}},
        "timestamping": {"enabled": True},
        **({} if me is None else _guarded(me)),
    }


def _is_free(end: str) -> bool:
    """Whether nobody listens at a TLS endpoint of this machine."""
    host, _, port = end.partition("/")[2].rpartition(":")
    try:
        socket.create_server((host, int(port))).close()
    except OSError:
        return False
    return True


def _guarded(me: Identity) -> dict[str, Any]:
    tls = {
        "root_ca_certificate": str(me.authority),
        "listen_private_key": str(me.key),
        "listen_certificate": str(me.certificate),
        "connect_private_key": str(me.key),
        "connect_certificate": str(me.certificate),
        "enable_mtls": True,
        "verify_name_on_connect": False,  # the rules go by the certificate's name; addresses change
    }
    return {
        "transport": {"link": {"tls": tls}},
        "access_control": access_control(me.fleet, me.name),
    }


class Gate:
    """The gate's process: started anew when it dies or when the machine's addresses change.

    `refused` counts who was turned away, by sentence. The process ends with this one, however that ends.
    """

    def __init__(
        self, me: Identity | None, doors: Doors, port: int = PORT, refused: Tally | None = None
    ) -> None:
        """UserError if it cannot be opened."""
        self.refused = Tally() if refused is None else refused
        self._me, self._doors, self._port = me, doors, port
        self._closing = threading.Event()
        self._config = gate_config(me, doors, port)
        self._process = self._start()
        self._watcher = threading.Thread(target=self._watch, name="gate watcher", daemon=True)
        self._watcher.start()

    @property
    def listens(self) -> list[str]:
        """Endpoints that others may join."""
        return list(self._config["listen"]["endpoints"])

    def close(self) -> None:
        """Shut it."""
        self._closing.set()
        self._watcher.join()
        _end(self._process)

    def __enter__(self) -> Gate:
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
            env={**os.environ, "RUST_LOG": LOGGED},
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
                f"the gate to other machines does not open: {answer.removeprefix(FAILED).strip()}"
            )
        threading.Thread(target=self._read, args=(process.stdout,), name="gate log", daemon=True).start()
        return process

    def _watch(self) -> None:
        while not self._closing.wait(LOOK_PERIOD):
            config = gate_config(self._me, self._doors, self._port, self.listens)
            if self._process.poll() is not None or config != self._config:
                self._config = config
                _end(self._process)
                self._restart()

    def _restart(self) -> None:
        try:
            self._process = self._start()
        except UserError as error:
            self.refused.add(str(error))

    def _read(self, lines: IO[str]) -> None:
        """Zenoh tells in its log only whom it turned away: once for each key that a member has no right to."""
        for line in lines:
            if sentence := turned_away(line, self._me.fleet.members if self._me else {}):
                self.refused.add(sentence)


def turned_away(line: str, members: Mapping[str, str]) -> str | None:
    """What a line of Zenoh's log tells of somebody who was refused, in a sentence."""
    plain = _COLOURS.sub("", line.rstrip())
    if found := _REFUSED.search(plain):
        return _refused(found[1], found[2], members)
    if found := _STRANGER.search(plain):
        return f"a stranger was turned away: {found[1]}"
    if (found := _ACCEPTED.search(plain)) and found[1] not in members:
        return f"{found[1]} is not on the fleet's list"
    return None


def _refused(who: str, key: str, members: Mapping[str, str]) -> str | None:
    """By topic or node, not by key: the keys of one topic are many.

    Of nodes nothing is said where a robot's router only passes on what it knows of people, or where they are tools.
    """
    if found := _DATA.fullmatch(key):
        return f"{who} may not write {found[1]}"
    if found := _NODE.fullmatch(key):
        space, name = found[1].replace("%", "/").rstrip("/"), found[2]
        of_people = members.get(space.partition("/")[2].partition("/")[0], "robot") != "robot"
        return None if of_people or name.startswith("_") else f"{who} may not tell of node {space}/{name}"
    return f"{who} may not write {key}"


def _end(process: subprocess.Popen[str]) -> None:
    """Its input ends, which it takes as its own end; harder if it does not."""
    assert process.stdin
    with suppress(OSError):
        process.stdin.close()
    try:
        process.wait(timeout=2.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

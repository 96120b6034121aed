"""Tests the limits per address and the slots of clients as rules, for any order of events."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.ui.access.address_limits import (
    BURST,
    KNOWN_BURST,
    LOOPBACK,
    MAX_ADDRESSES,
    MAX_STRANGERS,
    MAX_STRANGERS_PER_ADDRESS,
    MAX_STRANGERS_PER_KNOWN_ADDRESS,
    MAX_VISITORS,
    AddressLimits,
    address_group,
)
from chefbot.ui.access.client_slots import (
    ACTIVE_TIME,
    MAX_FULL_ACCESS,
    MAX_GUESTS,
    MAX_ONLY_STOP,
    ClientSlots,
)
from chefbot.ui.access.roles import ROLES
from chefbot.ui.access.visitors import ENGINEER, TokenKey, Visitor

HOSTS = st.sampled_from(
    ["10.0.0.1", "10.0.0.2", "2001:db8::1", "2001:db8::2", "2001:db8:0:1::1", "127.0.0.1"]
)


@pytest.mark.parametrize(
    ("host", "group"),
    [
        ("192.168.1.7", "192.168.1.7"),
        ("2001:db8::1", "2001:db8::/64"),
        ("2001:db8::ffff:1", "2001:db8::/64"),
        ("2001:db8:0:1::1", "2001:db8:0:1::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::ffff:192.168.1.7", "192.168.1.7"),
        ("127.0.0.1", LOOPBACK),
        ("127.9.9.9", LOOPBACK),
        ("::1", LOOPBACK),
        ("::ffff:127.0.0.1", LOOPBACK),
        ("testclient", "testclient"),
    ],
)
def test_addresses_are_grouped(host: str, group: str) -> None:
    assert address_group(host) == group


@given(st.lists(st.tuples(HOSTS, st.sampled_from(["come", "valid", "leave"])), max_size=400))
def test_connections_stay_bounded_in_any_order(events: list[tuple[str, str]]) -> None:
    limits: AddressLimits[int] = AddressLimits()
    alive: dict[int, str] = {}
    for number, (host, event) in enumerate(events):
        if event == "come":
            gone = limits.add(number, host, 0.0)
            alive[number] = host
            assert number not in gone, "the newest one is served"
        elif alive:
            connection = next(iter(alive)) if event == "leave" else next(reversed(alive))
            gone = limits.recognize(connection, 0.0) if event == "valid" else []
            if event == "leave":
                limits.remove(connection)
                del alive[connection]
        else:
            continue
        for connection in gone:
            del alive[connection]
        strangers = [connection for connection in alive if limits.is_stranger(connection)]
        assert len(strangers) <= MAX_STRANGERS and len(alive) - len(strangers) <= MAX_VISITORS
        groups = [address_group(alive[connection]) for connection in strangers]
        assert all(groups.count(group) <= MAX_STRANGERS_PER_KNOWN_ADDRESS for group in groups)


def test_an_attacker_replaces_only_connections_of_its_own() -> None:
    limits: AddressLimits[str] = AddressLimits()
    assert limits.add("operator", "10.0.0.1", 0.0) == []
    gone = [one for number in range(200) for one in limits.add(f"attacker {number}", "10.0.0.2", 0.0)]
    assert gone == [f"attacker {number}" for number in range(200 - MAX_STRANGERS_PER_ADDRESS)]
    many = [
        one
        for number in range(40)
        for count in range(4)
        for one in limits.add(f"net {number} {count}", f"2001:db8:{number:x}::{count}", 0.0)
    ]
    assert many and "operator" not in many, "its address has one, others have four"


def test_known_addresses_connect_more_often_for_a_while() -> None:
    limits: AddressLimits[str] = AddressLimits()
    assert sum(limits.may_connect("10.0.0.1", 0.0) for _ in range(1000)) == BURST
    limits.add("operator", "10.0.0.1", 0.0)
    limits.recognize("operator", 0.0)
    assert sum(limits.may_connect("10.0.0.1", 10.0) for _ in range(1000)) == KNOWN_BURST
    assert sum(limits.may_connect("10.0.0.1", 1000.0) for _ in range(1000)) == BURST, "no longer known"
    assert sum(limits.may_connect("127.0.0.1", 0.0) for _ in range(1000)) == KNOWN_BURST
    limits.add("owner", "127.0.0.1", 0.0)
    limits.recognize("owner", 0.0)
    assert sum(limits.may_connect("127.0.0.1", 1000.0) for _ in range(1000)) == KNOWN_BURST, "always known"


def test_remembered_addresses_are_bounded() -> None:
    limits: AddressLimits[str] = AddressLimits()
    for number in range(3 * MAX_ADDRESSES):
        limits.may_connect(f"10.{number // 65536}.{number // 256 % 256}.{number % 256}", 0.0)
    assert len(limits._addresses) == MAX_ADDRESSES


A_ROLE = st.sampled_from(ROLES)
STEPS = st.lists(
    st.tuples(
        st.sampled_from(["come", "command", "leave"]), A_ROLE, st.sampled_from("abc"), st.integers(0, 40)
    ),
    max_size=150,
)


@given(STEPS)
def test_slots_stay_bounded_and_who_commands_gets_in(steps: list[tuple[str, str, str, int]]) -> None:
    slots: ClientSlots[int] = ClientSlots()
    full: dict[int, str] = {}
    only_stop: set[int] = set()
    active: dict[int, float] = {}
    for now, (step, role, group, which) in enumerate(steps):
        clients = [*full, *only_stop]
        if step == "come":
            was_full = len(full) >= MAX_FULL_ACCESS
            busy = all(r != "guest" and active.get(c, -1.0) > now for c, r in full.items())
            admission = slots.admit(1000 + now, role, group, float(now))  # type: ignore[arg-type]
            for client in admission.demoted:
                del full[client]
                only_stop.add(client)
            if admission.full_access:
                full[1000 + now] = role
            else:
                only_stop.add(1000 + now)
            only_stop -= set(admission.dropped)
            assert 1000 + now not in admission.dropped
            assert role == "guest" or admission.full_access == (not was_full or not busy)
        elif clients and step == "command":
            client = clients[which % len(clients)]
            slots.note_command(client, float(now))
            active[client] = now + ACTIVE_TIME
        elif clients:
            client = clients[which % len(clients)]
            slots.remove(client)
            full.pop(client, None)
            only_stop.discard(client)
        assert len(full) <= MAX_FULL_ACCESS and len(only_stop) <= MAX_ONLY_STOP
        assert list(full.values()).count("guest") <= MAX_GUESTS


@given(st.from_regex(r"[A-Za-z0-9_-]{0,32}", fullmatch=True), A_ROLE, st.text(max_size=60))
def test_a_token_counts_for_its_visitor_only(name: str, role: str, forged: str) -> None:
    key, other = TokenKey("the secret of this robot"), TokenKey("the secret of another one")
    visitor = Visitor(name, role)  # type: ignore[arg-type]
    token = key.token(visitor)
    assert key.visitor(token) == visitor and other.visitor(token) is None
    assert key.visitor(forged) is None
    assert key.visitor(token.replace("guest", "engineer")) in (None, visitor)
    assert key.visitor(f"engineer.{name}.{token.rpartition('.')[2]}") in (None, visitor)
    assert key.token(ENGINEER).count(".") == 0

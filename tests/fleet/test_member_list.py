"""The list of members over any history of signatures, replacements, removals and deliveries of cards."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import msgspec
import pytest
from cryptography import x509
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from chefbot.errors import UserError
from chefbot.fleet.access_control import access_control
from chefbot.fleet.certificates import (
    CertificateId,
    authority_certificate,
    certificate_id,
    certificate_pem,
    common_name,
    ecdsa_sign,
    fingerprint,
    member_certificate,
    new_key,
    read_request,
    request_pem,
)
from chefbot.fleet.membership import Card, Fleet, Role, issue

NOW = datetime(2026, 1, 1, tzinfo=UTC)
KEY = new_key()
AUTHORITY = authority_certificate(KEY, "hotel", NOW)
NAMES = st.sampled_from(["robot1", "robot2", "robot10", "alice"])
ROLES: st.SearchStrategy[Role] = st.sampled_from(["robot", "operator", "site"])


def certificate(name: str, key: object = None) -> x509.Certificate:
    request = read_request(request_pem(key or new_key(), name), "request")  # type: ignore[arg-type]
    return member_certificate(request, name, KEY, AUTHORITY, NOW)


class Histories(RuleBasedStateMachine):
    """A fleet beside a model: the one valid certificate and the role of each name."""

    @initialize()
    def begin(self) -> None:
        self.fleet = Fleet("hotel", 0, {})
        self.valid: dict[str, tuple[str, Role]] = {}
        self.issued: list[x509.Certificate] = []

    def _sign(self, signed: x509.Certificate, role: Role | None, replace: bool) -> None:
        number = self.fleet.number
        self.fleet = self.fleet.with_member(signed, role, replace)
        assert self.fleet.number == number + 1
        name = certificate_id(signed).name
        kept = self.valid[name][1] if name in self.valid else role
        assert kept is not None
        self.valid[name] = (common_name(signed.subject), kept)
        self.issued.append(signed)

    @rule(name=NAMES, role=ROLES | st.none(), replace=st.booleans())
    def sign(self, name: str, role: Role | None, replace: bool) -> None:
        signed, fleet = certificate(name), self.fleet
        is_member = name in self.valid
        other_role = is_member and role not in (None, self.valid[name][1])
        if is_member != replace or other_role or (not is_member and role is None):
            with pytest.raises(UserError):
                fleet.with_member(signed, role, replace)
        else:
            self._sign(signed, role, replace)

    @precondition(lambda self: self.issued)
    @rule(data=st.data(), replace=st.booleans())
    def sign_a_used_key(self, data: st.DataObject, replace: bool) -> None:
        """No key gets a second certificate, of whatever name, living or removed."""
        signed = data.draw(st.sampled_from(self.issued))
        with pytest.raises(UserError):
            self.fleet.with_member(signed, None if replace else "robot", replace)

    @rule(name=NAMES)
    def remove(self, name: str) -> None:
        if name in self.valid:
            number = self.fleet.number
            self.fleet = self.fleet.without(name)
            assert self.fleet.number == number + 1
            del self.valid[name]
        else:
            with pytest.raises(UserError):
                self.fleet.without(name)

    @invariant()
    def exactly_the_valid_certificates_have_rights(self) -> None:
        rules = access_control(self.fleet, "robot1")
        named = [name for subject in rules["subjects"] for name in subject.get("cert_common_names", [])]
        assert sorted(named) == sorted(text for name, (text, _) in self.valid.items() if name != "robot1")
        for signed in self.issued:
            is_valid = self.fleet.is_valid(certificate_id(signed))
            assert is_valid == (common_name(signed.subject) in {text for text, _ in self.valid.values()})
            assert is_valid != (fingerprint(signed) in self.fleet.retired_keys)

    @invariant()
    def only_operators_and_sites_may_do_everything(self) -> None:
        everything = {
            policy["subjects"][0]
            for policy in access_control(self.fleet, "nobody")["policies"]
            if "all" in policy["rules"]
        }
        assert everything - {"this machine"} == {
            name for name, (_, role) in self.valid.items() if role != "robot"
        }

    @invariant()
    def the_signed_list_round_trips(self) -> None:
        assert issue(self.fleet, AUTHORITY, KEY).members("the card") == self.fleet


TestHistories = Histories.TestCase
TestHistories.settings = settings(max_examples=25, stateful_step_count=15, deadline=None)


@given(st.text(max_size=70), st.text(max_size=20))
def test_only_the_listed_serial_of_a_name_is_valid(name: str, serial: str) -> None:
    signed = certificate("robot1")
    fleet = Fleet("hotel", 0, {}).with_member(signed, "robot")
    assert fleet.is_valid(CertificateId(name, serial)) == ((name, serial) == certificate_id(signed))


LISTED = Fleet("hotel", 0, {}).with_member(certificate("robot1"), "robot")


@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=4))
def test_no_change_of_a_list_keeps_its_signature(place: int, change: bytes) -> None:
    card = issue(LISTED, AUTHORITY, KEY)
    data = bytearray(card.fleet)
    place %= len(data)
    data[place : place + len(change)] = change
    changed = msgspec.structs.replace(card, fleet=bytes(data))
    if bytes(data) == card.fleet:
        assert changed.members("the card") == LISTED
    else:
        with pytest.raises(UserError, match="was changed since the authority signed it"):
            changed.members("the card")


def test_a_list_of_another_version_is_reported_in_one_sentence() -> None:
    old = msgspec.json.encode({"name": "hotel", "serial": 3, "members": {"robot1": "robot"}})
    card = Card(certificate_pem(AUTHORITY), old, ecdsa_sign(old, KEY))
    with pytest.raises(UserError, match="is of another version of chefbot; create the fleet again"):
        card.members("the card")


@pytest.mark.parametrize(
    "change",
    [
        {"number": -1},
        {"name": "Hotel"},
        {"members": {"r" * 48: "same"}},
        {"members": {"robot1\n": "same"}},
        {"members": {"a.b": "same"}},
        {"members": {"robot1": {"serial": "*"}}},
        {"members": {"robot1": {"serial": "1"}}},
        {"members": {"robot1": {"key": ""}}},
        {"members": {"robot1": {"role": "chef"}}},
        {"members": {"robot1": {"expires": "2027-01-01T00:00:00"}}},
        {"retired_keys": ["x"]},
        {"retired_keys": "x"},
    ],
)
def test_a_signed_list_with_impossible_values_is_refused(change: dict[str, object]) -> None:
    tree = msgspec.json.decode(msgspec.json.encode(LISTED))
    member = tree["members"]["robot1"]
    members = change.get("members")
    if isinstance(members, dict):
        changed = {name: member if new == "same" else {**member, **new} for name, new in members.items()}
        change = {"members": changed}
    data = msgspec.json.encode({**tree, **change})
    with pytest.raises(UserError, match="the list in the card is of another version of chefbot"):
        Card(certificate_pem(AUTHORITY), data, ecdsa_sign(data, KEY)).members("the card")


def test_expiry_is_in_the_list() -> None:
    assert LISTED.members["robot1"].expires == NOW + timedelta(days=365)

"""Certificates of a fleet and the addresses of this machine."""

from __future__ import annotations

import ipaddress
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.errors import UserError
from chefbot.fleet import addresses
from chefbot.fleet.certificates import (
    CLOCK_TOLERANCE,
    MEMBER_VALIDITY,
    CertificateId,
    authority_certificate,
    certificate_id,
    certificate_pem,
    common_name,
    ecdsa_sign,
    fingerprint,
    is_signature_valid,
    is_signed_by,
    key_pem,
    member_certificate,
    new_key,
    read_certificate,
    read_key,
    read_request,
    request_pem,
    split_common_name,
)

NOW = datetime(2026, 1, 1, tzinfo=UTC)
KEY, OTHER = new_key(), new_key()
AUTHORITY, STRANGER = (authority_certificate(key, "hotel", NOW) for key in (KEY, OTHER))


def member(name: str = "robot_1", now: datetime = NOW) -> x509.Certificate:
    return member_certificate(read_request(request_pem(new_key(), name), "r"), name, KEY, AUTHORITY, now)


@pytest.mark.parametrize("name", ["robot_1", "alice", "x" * 47])
def test_a_member_certificate_has_its_name_serial_and_validity(name: str) -> None:
    certificate = member(name)
    assert certificate_id(certificate) == split_common_name(common_name(certificate.subject))
    assert certificate_id(certificate).name == name
    assert int(certificate_id(certificate).serial, 16) == certificate.serial_number
    assert common_name(certificate.issuer) == "hotel"
    assert certificate.not_valid_before_utc == NOW - CLOCK_TOLERANCE
    assert certificate.not_valid_after_utc - NOW == MEMBER_VALIDITY == timedelta(days=365)
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName)[0] == name.replace("_", "-")


def test_two_certificates_of_a_name_have_different_common_names() -> None:
    request = read_request(request_pem(new_key(), "robot1"), "r")
    first, second = (member_certificate(request, "robot1", KEY, AUTHORITY, NOW) for _ in range(2))
    assert common_name(first.subject) != common_name(second.subject)
    assert fingerprint(first) == fingerprint(second) == fingerprint(request) != fingerprint(member())


def test_a_slow_clock_since_the_fleet_began_accepts_members() -> None:
    later = member(now=NOW + timedelta(days=300))
    assert later.not_valid_before_utc == AUTHORITY.not_valid_before_utc


@given(st.text(max_size=80))
def test_any_common_name_can_be_split(text: str) -> None:
    parts = split_common_name(text)
    assert CertificateId(*parts).common_name == (text if "." in text else f"{text}.")


def test_only_the_own_authority_has_issued_a_member() -> None:
    assert is_signed_by(member(), AUTHORITY) and not is_signed_by(member(), STRANGER)
    constraints = member().extensions.get_extension_for_class(x509.BasicConstraints).value
    assert not constraints.ca, "a member cannot admit others"


def test_keys_and_certificates_round_trip_as_pem() -> None:
    assert key_pem(read_key(key_pem(KEY), "k")) == key_pem(KEY)
    assert read_certificate(certificate_pem(AUTHORITY), "c") == AUTHORITY
    assert b"PRIVATE" not in request_pem(KEY, "robot") + certificate_pem(AUTHORITY)


@given(st.binary(max_size=60), st.integers(0, 59), st.integers(1, 255))
@settings(max_examples=30)
def test_a_signature_is_valid_for_its_data_and_authority_only(data: bytes, place: int, change: int) -> None:
    signature = ecdsa_sign(data, KEY)
    assert is_signature_valid(signature, data, AUTHORITY)
    assert not is_signature_valid(signature, data, STRANGER)
    assert not is_signature_valid(signature, data + b"x", AUTHORITY)
    damaged = bytearray(signature)
    damaged[place] ^= change
    assert not is_signature_valid(bytes(damaged), data, AUTHORITY)


JUNK = [b"", b"junk", certificate_pem(AUTHORITY)[:100], key_pem(KEY)[:60]]


@pytest.mark.parametrize("junk", JUNK, ids=["empty", "text", "cut certificate", "cut key"])
def test_damaged_files_are_refused_with_their_name(junk: bytes) -> None:
    for read in (read_key, read_certificate, read_request):
        with pytest.raises(UserError, match="file x"):
            read(junk, "file x")


def test_own_addresses_are_ipv4_without_loopback() -> None:
    for address in addresses.addresses():
        assert not ipaddress.IPv4Address(address).is_loopback


def test_outside_linux_the_host_name_gives_the_addresses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(addresses, "fcntl", None)
    found = [(2, 1, 6, "", (address, 0)) for address in ("192.168.0.9", "127.0.1.1", "10.0.0.1")]
    monkeypatch.setattr(addresses.socket, "getaddrinfo", lambda *_: found)
    assert addresses.addresses() == ["10.0.0.1", "192.168.0.9"]

    def fails(*_: object) -> None:
        raise OSError

    monkeypatch.setattr(addresses.socket, "getaddrinfo", fails)
    assert addresses.addresses() == []

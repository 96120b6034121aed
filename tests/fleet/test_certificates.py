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
    authority_certificate,
    certificate_pem,
    common_name,
    ecdsa_sign,
    is_signature_valid,
    is_signed_by,
    key_pem,
    member_certificate,
    new_key,
    read_certificate,
    read_key,
    read_request,
    request_pem,
    requested_role,
)

NOW = datetime(2026, 1, 1, tzinfo=UTC)
KEY, OTHER = new_key(), new_key()
AUTHORITY, STRANGER = (authority_certificate(key, "hotel", NOW) for key in (KEY, OTHER))


def member(name: str = "robot_1", role: str = "robot") -> x509.Certificate:
    return member_certificate(read_request(request_pem(new_key(), name, role), "r"), KEY, AUTHORITY, NOW)


@pytest.mark.parametrize("name", ["robot_1", "alice"])
def test_a_member_certificate_has_its_name_role_and_validity(name: str) -> None:
    certificate = member(name)
    assert (common_name(certificate.subject), requested_role(certificate.subject)) == (name, "robot")
    assert common_name(certificate.issuer) == "hotel"
    assert certificate.not_valid_before_utc == NOW - CLOCK_TOLERANCE
    assert certificate.not_valid_after_utc - NOW == MEMBER_VALIDITY > timedelta(days=365)
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName)[0] == name.replace("_", "-")


def test_only_the_own_authority_has_issued_a_member() -> None:
    assert is_signed_by(member(), AUTHORITY) and not is_signed_by(member(), STRANGER)
    constraints = member().extensions.get_extension_for_class(x509.BasicConstraints).value
    assert not constraints.ca, "a member cannot admit others"


def test_keys_and_certificates_round_trip_as_pem() -> None:
    assert key_pem(read_key(key_pem(KEY), "k")) == key_pem(KEY)
    assert read_certificate(certificate_pem(AUTHORITY), "c") == AUTHORITY
    assert b"PRIVATE" not in request_pem(KEY, "robot", "robot") + certificate_pem(AUTHORITY)


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

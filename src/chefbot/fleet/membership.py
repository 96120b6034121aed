"""Members of a fleet, signed by its authority, and the card that a member receives."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal, TypeGuard, get_args

import msgspec
from cryptography import x509

from chefbot.config import read_bytes
from chefbot.errors import UserError
from chefbot.fleet.certificates import (
    PrivateKey,
    certificate_pem,
    ecdsa_sign,
    is_signature_valid,
    is_signed_by,
    read_certificate,
)

Role = Literal["robot", "operator", "site"]
"""A robot may only use keys below its own name; an operator and the site's router may use all."""

NAME = re.compile(r"[a-z][a-z0-9_]{0,62}")
MAX_CARD_BYTES = 1_000_000


class Fleet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The members of a fleet by name; of two lists the one with the higher serial number is valid."""

    name: str
    serial: int
    members: dict[str, Role]

    def with_member(self, name: str, role: Role) -> Fleet:
        """Return the fleet with a member added. Raises UserError if the name has another role."""
        if self.members.get(name, role) != role:
            raise UserError(
                f"{name} is a {self.members[name]} of fleet {self.name}; choose another name for the {role}"
            )
        return Fleet(self.name, self.serial + 1, {**self.members, name: role})

    def without(self, name: str) -> Fleet:
        """Return the fleet without a member. Raises UserError if there is no such member."""
        if name not in self.members:
            raise UserError(
                f"{name} is no member of fleet {self.name}; its members: {', '.join(self.members)}"
            )
        remaining = {member: role for member, role in self.members.items() if member != name}
        return Fleet(self.name, self.serial + 1, remaining)


class Card(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file that the authority gives to a member; it holds no secret."""

    authority: bytes
    """The authority's certificate, PEM."""
    fleet: bytes
    """The list of members, JSON; `signature` is the authority's signature of these bytes."""
    signature: bytes
    certificate: bytes = b""
    """The member's certificate, PEM; empty if only the list is updated."""

    def members(self, where: str) -> Fleet:
        """Return the list if authority, signature and certificate are consistent, else raise UserError."""
        authority = read_certificate(self.authority, where)
        if not is_signature_valid(self.signature, self.fleet, authority):
            raise UserError(f"{where} was changed since the authority signed it; fetch it from there again")
        if self.certificate and not is_signed_by(read_certificate(self.certificate, where), authority):
            raise UserError(
                f"the certificate in {where} is not of this authority; fetch the card from there again"
            )
        return msgspec.json.decode(self.fleet, type=Fleet)


def issue(fleet: Fleet, authority: x509.Certificate, key: PrivateKey, certificate: bytes = b"") -> Card:
    """Return a signed card of the fleet."""
    data = msgspec.json.encode(fleet)
    return Card(certificate_pem(authority), data, ecdsa_sign(data, key), certificate)


def read_card(path: Path) -> tuple[Card, Fleet]:
    """Read a card file. Raises UserError if it is invalid."""
    try:
        card = msgspec.json.decode(read_bytes(path, "card", MAX_CARD_BYTES), type=Card)
        return card, card.members(str(path))
    except (msgspec.DecodeError, UnicodeDecodeError):
        raise UserError(
            f"{path} is no card of a fleet; `chefbot fleet sign` on the authority's machine writes one"
        ) from None


def check_name(name: str) -> str:
    """Return the name if it can be a ROS namespace, else raise UserError."""
    if not NAME.fullmatch(name):
        raise UserError(
            f"{name!r} cannot be a member's name: use small letters, digits and _, a letter first"
        )
    return name


def is_role(text: str) -> TypeGuard[Role]:
    """Return whether the text is one of the roles."""
    return text in get_args(Role)

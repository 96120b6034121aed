"""Who belongs to a fleet, as its authority signed it, and the card that a member gets."""

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
    is_signature,
    is_signed_by,
    read_certificate,
    sign,
)

Role = Literal["robot", "operator", "site"]
"""A robot may write below its own name only; an operator and the site's router speak for people, to all."""

NAME = re.compile(r"[a-z][a-z0-9_]{0,62}")
MAX_CARD_BYTES = 1_000_000


class Fleet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The members by name. Of two lists the one with the higher serial number counts."""

    name: str
    serial: int
    members: dict[str, Role]

    def with_member(self, name: str, role: Role) -> Fleet:
        """UserError if the name has another role."""
        if self.members.get(name, role) != role:
            raise UserError(
                f"{name} is a {self.members[name]} of fleet {self.name}; choose another name for the {role}"
            )
        return Fleet(self.name, self.serial + 1, {**self.members, name: role})

    def without(self, name: str) -> Fleet:
        """UserError if there is no such member."""
        if name not in self.members:
            raise UserError(
                f"{name} is no member of fleet {self.name}; its members: {', '.join(self.members)}"
            )
        rest = {member: role for member, role in self.members.items() if member != name}
        return Fleet(self.name, self.serial + 1, rest)


class Card(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file that goes from the authority to a member; it holds no secret."""

    authority: bytes
    """Certificate, PEM."""
    fleet: bytes
    """The list of members, JSON, and the authority's signature of these bytes."""
    signature: bytes
    certificate: bytes = b""
    """The member's own, PEM; empty where only the list is news."""

    def members(self, where: str) -> Fleet:
        """The list, if authority, signature and certificate belong together; UserError if not."""
        authority = read_certificate(self.authority, where)
        if not is_signature(self.signature, self.fleet, authority):
            raise UserError(f"{where} was changed since the authority signed it; fetch it from there again")
        if self.certificate and not is_signed_by(read_certificate(self.certificate, where), authority):
            raise UserError(
                f"the certificate in {where} is not of this authority; fetch the card from there again"
            )
        return msgspec.json.decode(self.fleet, type=Fleet)


def issue(fleet: Fleet, authority: x509.Certificate, key: PrivateKey, certificate: bytes = b"") -> Card:
    """A card, signed."""
    data = msgspec.json.encode(fleet)
    return Card(certificate_pem(authority), data, sign(data, key), certificate)


def read_card(path: Path) -> tuple[Card, Fleet]:
    """UserError if the file is none, or not whole."""
    try:
        card = msgspec.json.decode(read_bytes(path, "card", MAX_CARD_BYTES), type=Card)
        return card, card.members(str(path))
    except msgspec.DecodeError:
        raise UserError(
            f"{path} is no card of a fleet; `chefbot keys sign` on the authority's machine writes one"
        ) from None


def check_name(name: str) -> str:
    """As it is; it becomes a ROS namespace. UserError if it cannot."""
    if not NAME.fullmatch(name):
        raise UserError(
            f"{name!r} cannot be a member's name: use small letters, digits and _, a letter first"
        )
    return name


def is_role(text: str) -> TypeGuard[Role]:
    """Whether it is one of the roles."""
    return text in get_args(Role)

"""Members of a fleet, signed by its authority, and the card that a member receives."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal, TypeGuard, get_args

import msgspec
from cryptography import x509
from msgspec import Meta

from chefbot.config import read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.fleet.certificates import (
    CertificateId,
    PrivateKey,
    certificate_id,
    certificate_pem,
    ecdsa_sign,
    fingerprint,
    is_signature_valid,
    is_signed_by,
    read_certificate,
)

Role = Literal["robot", "operator", "site"]
"""A robot may only use keys below its own name; an operator and the site's router may use all."""

MAX_NAME = 47
"""Maximum length of a member's name: with the serial number it is a common name of at most 64 characters."""
NAME = re.compile(rf"[a-z][a-z0-9_]{{0,{MAX_NAME - 1}}}")
MemberName = Annotated[str, Meta(pattern=rf"^{NAME.pattern}\Z")]
Fingerprint = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
MAX_CARD_BYTES = 1_000_000


class Member(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A member's role and its only valid certificate."""

    role: Role
    serial: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
    """The certificate's serial number."""
    key: Fingerprint
    """Fingerprint of the certificate's key."""
    expires: Annotated[datetime, Meta(tz=True)]


class Fleet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The members of a fleet by name; of two lists the one with the higher number is valid."""

    name: MemberName
    number: Annotated[int, Meta(ge=0)]
    members: dict[MemberName, Member]
    retired_keys: tuple[Fingerprint, ...] = ()
    """Fingerprints of the keys of former certificates, which are not signed again."""

    def with_member(
        self, certificate: x509.Certificate, role: Role | None = None, replace: bool = False
    ) -> Fleet:
        """Return the fleet in which this is the only valid certificate of its name.

        `role`: None for that of the certificate that is replaced. Raises UserError unless `replace` is true
        exactly if the name has a certificate, and for another role or a key that was used before.
        """
        (name, serial), key = certificate_id(certificate), fingerprint(certificate)
        old = self.members.get(name)
        self._check_replacement(name, replace)
        self._check_key(name, key)
        member = Member(self._role(name, role), serial, key, certificate.not_valid_after_utc)
        retired = self.retired_keys if old is None else (*self.retired_keys, old.key)
        return Fleet(self.name, self.number + 1, {**self.members, name: member}, retired)

    def without(self, name: str) -> Fleet:
        """Return the fleet without a member. Raises UserError if there is no such member."""
        remaining = dict(self.members)
        removed = remaining.pop(name, None)
        if removed is None:
            raise UserError(f"{name} is not a member of fleet {self.name}{name_hint(name, self.members)}")
        return Fleet(self.name, self.number + 1, remaining, (*self.retired_keys, removed.key))

    def is_valid(self, certificate: CertificateId) -> bool:
        """Return whether this is the valid certificate of its name."""
        member = self.members.get(certificate.name)
        return member is not None and member.serial == certificate.serial

    def _check_replacement(self, name: str, replace: bool) -> None:
        old = self.members.get(name)
        if old is not None and not replace:
            raise UserError(
                f"{name} is a member of fleet {self.name} already (certificate {old.serial}, valid until "
                f"{old.expires:%Y-%m-%d}); --replace signs this one and refuses that one from then on"
            )
        if old is None and replace:
            raise UserError(
                f"fleet {self.name} has no member {name} whose certificate could be replaced"
                f"{name_hint(name, self.members)}; a new member is signed without --replace"
            )

    def _check_key(self, name: str, key: str) -> None:
        if key in self.retired_keys or any(key == member.key for member in self.members.values()):
            raise UserError(
                f"the request of {name} is for a key that was signed before; make a new one on its machine "
                "with `chefbot fleet request NAME`, or `chefbot fleet renew` if it is a member"
            )

    def _role(self, name: str, role: Role | None) -> Role:
        """Return the role of a new certificate."""
        old = self.members.get(name)
        if old is not None and role not in (None, old.role):
            raise UserError(
                f"{name} is a {old.role} of fleet {self.name}; choose another name for the {role}"
            )
        chosen = role if old is None else old.role
        if chosen is None:
            raise UserError(
                f"{name} is new in fleet {self.name}: choose its role, --role robot or --role operator"
            )
        return chosen


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
        try:
            return msgspec.json.decode(self.fleet, type=Fleet)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            raise UserError(
                f"the list in {where} is of another version of chefbot; create the fleet again with "
                "`chefbot fleet init` in a new folder"
            ) from None


def issue(fleet: Fleet, authority: x509.Certificate, key: PrivateKey, certificate: bytes = b"") -> Card:
    """Return a signed card of the fleet."""
    data = msgspec.json.encode(fleet)
    return Card(certificate_pem(authority), data, ecdsa_sign(data, key), certificate)


def read_card(path: Path) -> tuple[Card, Fleet]:
    """Read a card file. Raises UserError if it is invalid."""
    try:
        card = msgspec.json.decode(read_bytes(path, "card", MAX_CARD_BYTES), type=Card)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise UserError(
            f"{path} is not a card of a fleet; `chefbot fleet sign` on the authority's machine writes one"
        ) from None
    return card, card.members(str(path))


def check_name(name: str) -> str:
    """Return the name if it can be a ROS namespace and part of a common name, else raise UserError."""
    if not NAME.fullmatch(name):
        shown = name if len(name) <= MAX_NAME else f"{name[:MAX_NAME]}..."
        raise UserError(
            f"{shown!r} cannot be a member's name: use small letters, digits and _, a letter first, "
            f"at most {MAX_NAME}"
        )
    return name


def check_role(text: str) -> Role:
    """Return the text if it is one of the roles, else raise UserError."""
    if not _is_role(text):
        raise UserError(f"there is no role {text!r}{name_hint(text, get_args(Role))}")
    return text


def _is_role(text: str) -> TypeGuard[Role]:
    return text in get_args(Role)

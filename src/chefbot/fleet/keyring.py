"""The key folder of this machine; its private keys are readable by their owner only and never leave it.

authority.key  authority.pem   the fleet's certificate authority; the key is on one machine only
me.key  NAME.request  me.pem   this machine's key, certificate signing request and certificate
card.json                      the list of members, signed by the authority
"""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path
from typing import NamedTuple, get_args

import msgspec
from cryptography import x509

from chefbot.config import read_bytes
from chefbot.errors import UserError
from chefbot.fleet.certificates import (
    PrivateKey,
    authority_certificate,
    certificate_pem,
    common_name,
    key_pem,
    member_certificate,
    new_key,
    read_certificate,
    read_key,
    read_request,
    request_pem,
    requested_role,
)
from chefbot.fleet.membership import Card, Fleet, Role, check_name, is_role, issue, read_card
from chefbot.storage.atomic_files import write_atomic

MAX_PEM_BYTES = 100_000


def keys_folder() -> Path:
    """Return CHEFBOT_KEYS, else the folder below the user's configuration (XDG_CONFIG_HOME, ~/.config)."""
    if folder := os.environ.get("CHEFBOT_KEYS"):
        return Path(folder)
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "chefbot" / "keys"


class Identity(NamedTuple):
    """This machine's identity in its fleet, and the fleet's members."""

    name: str
    fleet: Fleet
    authority: Path
    key: Path
    certificate: Path
    expires: datetime

    @property
    def role(self) -> Role | None:
        """This machine's role; None after it was removed from the fleet."""
        return self.fleet.members.get(self.name)


class Keyring:
    """The key folder; every method raises UserError if a file that it needs is missing or invalid."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._authority_key_path, self._authority_path = folder / "authority.key", folder / "authority.pem"
        self._key_path, self._certificate_path = folder / "me.key", folder / "me.pem"
        self._card_path = folder / "card.json"

    @property
    def is_member(self) -> bool:
        """Whether this machine was admitted to a fleet."""
        return self._certificate_path.exists()

    @property
    def is_authority(self) -> bool:
        """Whether this machine holds the authority's key."""
        return self._authority_key_path.exists()

    def identity(self) -> Identity:
        """Return this machine's identity as a member."""
        if not self.is_member:
            raise UserError(f"this machine belongs to no fleet ({self.folder}); see `chefbot fleet --help`")
        _, fleet = read_card(self._card_path)
        certificate = self._load_certificate(self._certificate_path)
        return Identity(
            common_name(certificate.subject),
            fleet,
            self._authority_path,
            self._key_path,
            self._certificate_path,
            certificate.not_valid_after_utc,
        )

    def create_fleet(self, fleet: str, now: datetime) -> Fleet:
        """Create a fleet with this machine as its authority and site router."""
        if self.is_authority or self._key_path.exists():
            raise UserError(f"{self.folder} holds keys already; choose another folder or keep that fleet")
        key = new_key()
        authority = authority_certificate(key, check_name(fleet), now)
        self._write_secret(self._authority_key_path, key_pem(key))
        write_atomic(self._authority_path, certificate_pem(authority))
        write_atomic(self._card_path, msgspec.json.encode(issue(Fleet(fleet, 0, {}), authority, key)))
        self.accept(self.admit(self.request_membership("site", "site"), now)[0])
        return self.identity().fleet

    def request_membership(self, name: str, role: Role) -> Path:
        """Make this machine's key and certificate signing request; return the path of the request."""
        if self.is_member:
            raise UserError(
                f"this machine is {self.identity().name} already ({self.folder}); choose another folder"
            )
        if not self._key_path.exists():
            self._write_secret(self._key_path, key_pem(new_key()))
        key = self._load_key(self._key_path)
        request = self.folder / f"{check_name(name)}.request"
        write_atomic(request, request_pem(key, name, role))
        return request

    def admit(self, request: Path, now: datetime) -> tuple[Card, str]:
        """Admit the member that a request names; return its card and its name."""
        csr = read_request(read_bytes(request, "request", MAX_PEM_BYTES), str(request))
        name, role = check_name(common_name(csr.subject)), requested_role(csr.subject)
        if not is_role(role):
            raise UserError(f"{request} asks for the role {role!r}; there are {', '.join(get_args(Role))}")
        key, authority, fleet = self._as_authority()
        certificate = member_certificate(csr, key, authority, now)
        card = issue(fleet.with_member(name, role), authority, key, certificate_pem(certificate))
        self._store_card(card)
        return card, name

    def remove(self, name: str) -> Card:
        """Remove a member; return the card with the new list, for all other members."""
        key, authority, fleet = self._as_authority()
        card = issue(fleet.without(name), authority, key)
        self._store_card(card)
        return card

    def card(self) -> Card:
        """Return the list of members as this machine has it, for other machines."""
        card, _ = read_card(self._card_path)
        return msgspec.structs.replace(card, certificate=b"")

    def accept(self, card: Card) -> Fleet:
        """Store the list, and this machine's certificate if the card contains it."""
        fleet = card.members("the card")
        if self._card_path.exists():
            self._check_update(card, fleet)
        is_own = bool(card.certificate) and self._is_own(card.certificate)
        if not is_own and not self.is_member:
            raise UserError(
                "the card is not for this machine's key; accept this machine's own card first, which "
                "`chefbot fleet sign` makes of its request"
            )
        write_atomic(self._authority_path, card.authority)
        self._store_card(card)
        if is_own:
            write_atomic(self._certificate_path, card.certificate)
        return fleet

    def _check_update(self, card: Card, fleet: Fleet) -> None:
        old_card, old_fleet = read_card(self._card_path)
        if old_card.authority != card.authority:
            raise UserError(
                f"the card was issued by another authority than the one of fleet {old_fleet.name} in {self.folder}"
            )
        if fleet.serial < old_fleet.serial:
            raise UserError(
                f"the card's list is older ({fleet.serial}) than this machine's ({old_fleet.serial}), which is kept"
            )

    def _is_own(self, pem: bytes) -> bool:
        if not self._key_path.exists():
            raise UserError(
                f"{self.folder} has no key; `chefbot fleet robot NAME` or `operator NAME` comes first"
            )
        return read_certificate(pem, "the card").public_key() == self._load_key(self._key_path).public_key()

    def _store_card(self, card: Card) -> None:
        write_atomic(self._card_path, msgspec.json.encode(msgspec.structs.replace(card, certificate=b"")))

    def _as_authority(self) -> tuple[PrivateKey, x509.Certificate, Fleet]:
        if not self.is_authority:
            raise UserError(f"{self.folder} is not the authority's; sign where `chefbot fleet init` was run")
        key = self._load_key(self._authority_key_path)
        return key, self._load_certificate(self._authority_path), read_card(self._card_path)[1]

    def _load_key(self, path: Path) -> PrivateKey:
        return read_key(read_bytes(path, "key", MAX_PEM_BYTES), str(path))

    def _load_certificate(self, path: Path) -> x509.Certificate:
        return read_certificate(read_bytes(path, "certificate", MAX_PEM_BYTES), str(path))

    def _write_secret(self, path: Path, data: bytes) -> None:
        """Write a file that only its owner can read from the first byte on."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        old_umask = os.umask(0o077)
        try:
            write_atomic(path, data)
        finally:
            os.umask(old_umask)

"""The keys of this machine: one folder, whose private keys nobody else reads and which never leave it.

authority.key  authority.pem   the fleet's own; the key on one machine only
me.key  me.request  me.pem     this machine's
card.json                      the list of members, as the authority signed it
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
    wanted_role,
)
from chefbot.fleet.membership import Card, Fleet, Role, check_name, is_role, issue, read_card
from chefbot.storage.atomic_files import write_atomic

MAX_PEM_BYTES = 100_000


def keys_folder() -> Path:
    """CHEFBOT_KEYS, else below the user's configuration (XDG_CONFIG_HOME, ~/.config)."""
    if own := os.environ.get("CHEFBOT_KEYS"):
        return Path(own)
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "chefbot" / "keys"


class Identity(NamedTuple):
    """Who this machine is, and who else there is."""

    name: str
    fleet: Fleet
    authority: Path
    key: Path
    certificate: Path
    ends: datetime

    @property
    def role(self) -> Role | None:
        """None once it was taken off the list."""
        return self.fleet.members.get(self.name)


class Keyring:
    """The folder. Every method raises UserError with one sentence if what it needs is not there or not whole."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._authority_key, self._authority = folder / "authority.key", folder / "authority.pem"
        self._key, self._mine = folder / "me.key", folder / "me.pem"
        self._card = folder / "card.json"

    @property
    def is_member(self) -> bool:
        """Whether this machine was admitted to a fleet."""
        return self._mine.exists()

    @property
    def is_authority(self) -> bool:
        """Whether this machine signs."""
        return self._authority_key.exists()

    def identity(self) -> Identity:
        """Of a member."""
        if not self.is_member:
            raise UserError(f"this machine belongs to no fleet ({self.folder}); see `chefbot keys --help`")
        _, fleet = read_card(self._card)
        mine = self._certificate(self._mine)
        return Identity(
            common_name(mine.subject), fleet, self._authority, self._key, self._mine, mine.not_valid_after_utc
        )

    def found(self, fleet: str, now: datetime) -> Fleet:
        """A new fleet, whose authority and site router this machine is."""
        if self.is_authority or self._key.exists():
            raise UserError(f"{self.folder} holds keys already; choose another folder or keep that fleet")
        key = new_key()
        authority = authority_certificate(key, check_name(fleet), now)
        self._write_secret(self._authority_key, key_pem(key))
        write_atomic(self._authority, certificate_pem(authority))
        write_atomic(self._card, msgspec.json.encode(issue(Fleet(fleet, 0, {}), authority, key)))
        self.accept(self.sign(self.ask("site", "site"), now)[0])
        return self.identity().fleet

    def ask(self, name: str, role: Role) -> Path:
        """Make this machine's key, and the request that the authority has to sign; where the request is."""
        if self.is_member:
            raise UserError(
                f"this machine is {self.identity().name} already ({self.folder}); choose another folder"
            )
        if not self._key.exists():
            self._write_secret(self._key, key_pem(new_key()))
        key = read_key(read_bytes(self._key, "key", MAX_PEM_BYTES), str(self._key))
        request = self.folder / f"{check_name(name)}.request"
        write_atomic(request, request_pem(key, name, role))
        return request

    def sign(self, request: Path, now: datetime) -> tuple[Card, str]:
        """Admit who asks; the card for it, and its name."""
        wish = read_request(read_bytes(request, "request", MAX_PEM_BYTES), str(request))
        name, role = check_name(common_name(wish.subject)), wanted_role(wish.subject)
        if not is_role(role):
            raise UserError(f"{request} asks for the role {role!r}; there are {', '.join(get_args(Role))}")
        key, authority, fleet = self._as_authority()
        certificate = member_certificate(wish, key, authority, now)
        card = issue(fleet.with_member(name, role), authority, key, certificate_pem(certificate))
        self._keep(card)
        return card, name

    def remove(self, name: str) -> Card:
        """Take a member off the list; the card with the new list, for all others."""
        key, authority, fleet = self._as_authority()
        card = issue(fleet.without(name), authority, key)
        self._keep(card)
        return card

    def card(self) -> Card:
        """The list as this machine has it, for others."""
        card, _ = read_card(self._card)
        return msgspec.structs.replace(card, certificate=b"")

    def accept(self, card: Card) -> Fleet:
        """Take the list, and this machine's certificate if it is in the card, from the authority."""
        fleet = card.members("the card")
        if self._card.exists():
            self._check_news(card, fleet)
        mine = bool(card.certificate) and self._is_mine(card.certificate)
        if not mine and not self.is_member:
            raise UserError(
                "the card is not for this machine's key; accept this machine's own card first, which "
                "`chefbot keys sign` makes of its request"
            )
        write_atomic(self._authority, card.authority)
        self._keep(card)
        if mine:
            write_atomic(self._mine, card.certificate)
        return fleet

    def _check_news(self, card: Card, fleet: Fleet) -> None:
        old, before = read_card(self._card)
        if old.authority != card.authority:
            raise UserError(
                f"the card is of another authority than the one of fleet {before.name} in {self.folder}"
            )
        if fleet.serial < before.serial:
            raise UserError(
                f"the card's list is older ({fleet.serial}) than this machine's ({before.serial}); keep this"
            )

    def _is_mine(self, pem: bytes) -> bool:
        if not self._key.exists():
            raise UserError(
                f"{self.folder} has no key; `chefbot keys robot NAME` or `operator NAME` comes first"
            )
        key = read_key(read_bytes(self._key, "key", MAX_PEM_BYTES), str(self._key))
        return read_certificate(pem, "the card").public_key() == key.public_key()

    def _keep(self, card: Card) -> None:
        write_atomic(self._card, msgspec.json.encode(msgspec.structs.replace(card, certificate=b"")))

    def _as_authority(self) -> tuple[PrivateKey, x509.Certificate, Fleet]:
        if not self.is_authority:
            raise UserError(f"{self.folder} is not the authority's; sign where `chefbot keys init` was said")
        key = read_key(read_bytes(self._authority_key, "key", MAX_PEM_BYTES), str(self._authority_key))
        return key, self._certificate(self._authority), read_card(self._card)[1]

    def _certificate(self, path: Path) -> x509.Certificate:
        return read_certificate(read_bytes(path, "certificate", MAX_PEM_BYTES), str(path))

    def _write_secret(self, path: Path, data: bytes) -> None:
        """Readable by its owner only, from the first byte on."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        before = os.umask(0o077)
        try:
            write_atomic(path, data)
        finally:
            os.umask(before)

"""The key folder of this machine; its private keys are readable by their owner only and never leave it.

authority.key  authority.pem   the fleet's certificate authority; the key is on one machine only
me.key  me.pem                 this machine's key and certificate
new.key  NAME.request          a new key and its certificate signing request, until a card has its certificate
card.json                      the list of members, signed by the authority
"""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import msgspec
from cryptography import x509

from chefbot.config import read_bytes
from chefbot.errors import ChefbotError, UserError
from chefbot.fleet.certificates import (
    PrivateKey,
    authority_certificate,
    certificate_id,
    certificate_pem,
    common_name,
    fingerprint,
    key_pem,
    member_certificate,
    new_key,
    read_certificate,
    read_key,
    read_request,
    request_pem,
)
from chefbot.fleet.identity import Identity, advice, check_clock, check_secret, check_validity
from chefbot.fleet.membership import Card, Fleet, Role, check_name, issue, read_card
from chefbot.storage.atomic_files import os_errors_as_storage_errors, write_atomic

MAX_PEM_BYTES = 100_000


def keys_folder() -> Path:
    """Return CHEFBOT_KEYS, else the folder below the user's configuration (XDG_CONFIG_HOME, ~/.config)."""
    if folder := os.environ.get("CHEFBOT_KEYS"):
        return Path(folder)
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "chefbot" / "keys"


class Keyring:
    """The key folder; every method raises UserError if a file that it needs is missing or invalid."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._authority_key_path, self._authority_path = folder / "authority.key", folder / "authority.pem"
        self._key_path, self._certificate_path = folder / "me.key", folder / "me.pem"
        self._new_key_path, self._card_path = folder / "new.key", folder / "card.json"

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
            certificate_id(certificate),
            fleet,
            self._authority_path,
            self._key_path,
            self._certificate_path,
            certificate.not_valid_before_utc,
            certificate.not_valid_after_utc,
        )

    def credentials(self, now: datetime) -> Identity:
        """Return this machine's identity if other machines can accept its certificate now."""
        me = self.identity()
        key, certificate = self._load_key(self._key_path), self._load_certificate(self._certificate_path)
        if key.public_key() != certificate.public_key():
            raise UserError(
                f"{self._key_path} and {self._certificate_path} do not belong together: accept this machine's "
                "last card again with `chefbot fleet accept`"
            )
        check_validity(me, now)
        return me

    def warning(self, now: datetime) -> str:
        """Return what prevents the use of this machine's certificate or will soon, or an empty string."""
        try:
            return advice(self.credentials(now), now)
        except ChefbotError as error:
            return str(error)

    def authority_fingerprint(self) -> str:
        """Return the fingerprint of the key of this machine's authority."""
        return fingerprint(self._load_certificate(self._authority_path))

    def file_versions(self) -> tuple[tuple[int, int, int], ...]:
        """Return values that change whenever key, certificate or list are written."""
        paths = (self._key_path, self._certificate_path, self._card_path)
        return tuple(_file_version(path) for path in paths)

    def create_fleet(self, fleet: str, now: datetime) -> Fleet:
        """Create a fleet with this machine as its authority and site router."""
        if self.is_authority or self._key_path.exists():
            raise UserError(f"{self.folder} holds keys already; choose another folder or keep that fleet")
        key = new_key()
        authority = authority_certificate(key, check_name(fleet), now)
        self._write_secret(self._authority_key_path, key_pem(key))
        write_atomic(self._authority_path, certificate_pem(authority))
        write_atomic(self._card_path, msgspec.json.encode(issue(Fleet(fleet, 0, {}), authority, key)))
        self.accept(self.admit(self.request_membership("site"), now, "site")[0])
        return self.identity().fleet

    def request_membership(self, name: str) -> Path:
        """Make a new key and its certificate signing request; return the path of the request."""
        if self.is_member:
            raise UserError(
                f"this machine is {self.identity().name} already ({self.folder}); `chefbot fleet renew` renews "
                "its certificate, and another folder makes it another member"
            )
        return self._new_request(check_name(name))

    def renew(self, now: datetime) -> Path | None:
        """Make a new key and request for this member; return the path of the request.

        The old key stays in use until the new certificate is accepted. The authority signs and accepts its own
        request at once; None then.
        """
        request = self._new_request(check_name(self.identity().name))
        if not self.is_authority:
            return request
        self.accept(self.admit(request, now, replace=True)[0])
        return None

    def admit(
        self, request: Path, now: datetime, role: Role | None = None, replace: bool = False
    ) -> tuple[Card, str]:
        """Sign a request; return the member's card and its name.

        `role`: of a new member; None for a member whose certificate is replaced.
        """
        csr = _load_request(request)
        name = check_name(common_name(csr.subject))
        key, authority, fleet = self._as_authority()
        check_clock(now, authority.not_valid_before_utc, fleet.name)
        certificate = member_certificate(csr, name, key, authority, now)
        card = issue(
            fleet.with_member(certificate, role, replace), authority, key, certificate_pem(certificate)
        )
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
        """Store the list, and this machine's certificate if the card contains it; return the newest list.

        A list that is older than this machine's is refused. The certificate beside it is stored if the newer
        list has it, so that cards may come in any order.
        """
        fleet = card.members("the card")
        newest = self._newest(card, fleet)
        certificate = read_certificate(card.certificate, "the card") if card.certificate else None
        key = None if certificate is None else self._matching_key(certificate)
        if key is None and not self.is_member:
            raise UserError(
                "the card is not for this machine's key; accept this machine's own card first, which "
                "`chefbot fleet sign` makes of its request"
            )
        is_in_newest = (
            certificate is not None and key is not None and newest.is_valid(certificate_id(certificate))
        )
        if newest is not fleet and not is_in_newest:
            raise UserError(
                f"the card's list is older ({fleet.number}) than this machine's ({newest.number}), which is kept"
            )
        if newest is fleet:
            write_atomic(self._authority_path, card.authority)
            self._store_card(card)
        if key is not None:
            self._store_certificate(card.certificate, key)
        return newest

    def _newest(self, card: Card, fleet: Fleet) -> Fleet:
        """Return the card's list, or this machine's if that is newer."""
        if not self._card_path.exists():
            return fleet
        own_card, own_fleet = read_card(self._card_path)
        if own_card.authority != card.authority:
            raise UserError(
                f"the card was issued by another authority than the one of fleet {own_fleet.name} in {self.folder}"
            )
        return own_fleet if fleet.number < own_fleet.number else fleet

    def _matching_key(self, certificate: x509.Certificate) -> PrivateKey | None:
        """Return the key of this machine that the certificate is for."""
        paths = [path for path in (self._new_key_path, self._key_path) if path.exists()]
        if not paths:
            raise UserError(f"{self.folder} has no key; `chefbot fleet request NAME` comes first")
        keys = map(self._load_key, paths)
        return next((key for key in keys if key.public_key() == certificate.public_key()), None)

    def _store_certificate(self, pem: bytes, key: PrivateKey) -> None:
        """Put a key and its certificate into use; after an interruption the card can be accepted again."""
        self._write_secret(self._key_path, key_pem(key))
        write_atomic(self._certificate_path, pem)
        new_key_path = self._new_key_path
        if new_key_path.exists() and key_pem(self._load_key(new_key_path)) == key_pem(key):
            new_key_path.unlink()

    def _new_request(self, name: str) -> Path:
        key = new_key()
        self._write_secret(self._new_key_path, key_pem(key))
        request = self.folder / f"{name}.request"
        write_atomic(request, request_pem(key, name))
        return request

    def _store_card(self, card: Card) -> None:
        write_atomic(self._card_path, msgspec.json.encode(msgspec.structs.replace(card, certificate=b"")))

    def _as_authority(self) -> tuple[PrivateKey, x509.Certificate, Fleet]:
        if not self.is_authority:
            raise UserError(f"{self.folder} is not the authority's; sign where `chefbot fleet init` was run")
        key = self._load_key(self._authority_key_path)
        return key, self._load_certificate(self._authority_path), read_card(self._card_path)[1]

    def _load_key(self, path: Path) -> PrivateKey:
        check_secret(path)
        return read_key(read_bytes(path, "key", MAX_PEM_BYTES), str(path))

    def _load_certificate(self, path: Path) -> x509.Certificate:
        return read_certificate(read_bytes(path, "certificate", MAX_PEM_BYTES), str(path))

    def _write_secret(self, path: Path, data: bytes) -> None:
        """Write a file that only its owner can read from the first byte on."""
        with os_errors_as_storage_errors(path):
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        old_umask = os.umask(0o077)
        try:
            write_atomic(path, data)
        finally:
            os.umask(old_umask)


def request_fingerprint(request: Path) -> str:
    """Return the fingerprint of a request's key. Raises UserError if it is not a request."""
    return fingerprint(_load_request(request))


def _load_request(path: Path) -> x509.CertificateSigningRequest:
    return read_request(read_bytes(path, "request", MAX_PEM_BYTES), str(path))


def _file_version(path: Path) -> tuple[int, int, int]:
    try:
        status = path.stat()
    except OSError:
        return (0, 0, 0)
    return (status.st_ino, status.st_mtime_ns, status.st_size)

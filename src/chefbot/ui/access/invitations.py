"""Invitations: links of persons that stay valid until they are revoked, kept in the robot's state folder.

The file contains a hash of each token only, so that who reads it, or a copy of it, gets no access.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import unicodedata
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from chefbot.devices.state_files import state_folder
from chefbot.errors import UserError, name_hint
from chefbot.storage.atomic_files import OWNER_ONLY, StorageError, make_folder, write_atomic
from chefbot.ui.access.visitors import Role, Visitor

TOKEN_BYTES = 16
"""Random bytes of a token."""
MAX_NAME, MAX_PEOPLE = 40, 200
"""Maximum length of a name, characters, and maximum number of persons."""
PEOPLE = ".people.json"
"""Ending of the file with the persons who are invited to a robot's web UI."""


def _ignore(_: str) -> None:
    """Take a warning that nobody wants."""


class InvitedPerson(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An invited person; `invited` is UTC in ISO 8601, `token_hash` the SHA-256 of the token in hexadecimal."""

    name: str
    role: Role
    invited: str
    token_hash: str


class Invitations:
    """The persons who are invited to a robot's web UI; another process may change the file at any time.

    `warn` is called if it turns out that nobody can be let in because the file cannot be read.
    """

    def __init__(self, robot: str, warn: Callable[[str], None] = _ignore) -> None:
        self.robot, self.warn = robot, warn
        self.path = page_folder() / f"{robot}{PEOPLE}"
        self._version: tuple[int, int] | None = None
        self._people: tuple[InvitedPerson, ...] = ()

    def people(self) -> tuple[InvitedPerson, ...]:
        """Return the invited persons in the order of their invitations. Raises StorageError for a damaged file."""
        try:
            status = self.path.stat()
            # A rename changes the inode, so that two changes within one tick of the clock are noticed, too.
            version = (status.st_mtime_ns, status.st_ino)
            if version != self._version:
                self._people = msgspec.json.decode(self.path.read_bytes(), type=tuple[InvitedPerson, ...])
                self._version = version
        except FileNotFoundError:
            return ()
        except (OSError, msgspec.MsgspecError) as error:
            raise StorageError(
                f"the invitations {self.path} cannot be read: {error}; restore the file, or delete it and invite "
                "everyone again"
            ) from None
        return self._people

    def invite(self, name: str, role: Role) -> str:
        """Return a new token of a person, which replaces an older one. Raises UserError for an invalid name."""
        name = checked_name(name)
        others = tuple(person for person in self.people() if person.name != name)
        if len(others) >= MAX_PEOPLE:
            raise UserError(f"{MAX_PEOPLE} persons are invited already; revoke some of them first")
        token = secrets.token_urlsafe(TOKEN_BYTES)
        person = InvitedPerson(name, role, datetime.now(UTC).isoformat(timespec="seconds"), _hash(token))
        self._write((*others, person))
        return token

    def revoke(self, name: str) -> None:
        """Make the link of a person invalid. Raises UserError if there is none of this name."""
        name, names = unicodedata.normalize("NFC", name), [person.name for person in self.people()]
        if name not in names:
            raise UserError(f"{name!r} is not invited{name_hint(name, names) if names else '; nobody is'}")
        self._write(tuple(person for person in self.people() if person.name != name))

    def visitor(self, token: str) -> Visitor | None:
        """Return the person to whom a token was given, or None. Raises StorageError for a damaged file."""
        digest = _hash(token)
        for person in self.people():
            if hmac.compare_digest(person.token_hash.encode(), digest.encode()):
                return Visitor(person.name, person.role)
        return None

    def _write(self, people: tuple[InvitedPerson, ...]) -> None:
        write_private(self.path, msgspec.json.format(msgspec.json.encode(people)) + b"\n")


def page_folder() -> Path:
    """Return the folder with what is known of the web UIs of this computer's robots."""
    return state_folder() / "page"


def checked_name(name: str) -> str:
    """Return a name in its composed form (Unicode NFC). Raises UserError unless it can be shown in one line."""
    name = unicodedata.normalize("NFC", name)
    if not name or name != name.strip() or len(name) > MAX_NAME or not name.isprintable():
        raise UserError(
            f"the name {name!r} must have 1 to {MAX_NAME} printable characters and no space around it"
        )
    return name


def write_private(path: Path, data: bytes) -> None:
    """Write a file that only its owner can read, at any moment. Raises StorageError."""
    make_folder(path.parent)
    write_atomic(path, data, OWNER_ONLY)


def _hash(token: str) -> str:
    """Return the hash of a token: a plain one is enough, since a token is random and long."""
    return hashlib.sha256(token.encode()).hexdigest()

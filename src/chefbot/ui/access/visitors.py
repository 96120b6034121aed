"""Visitors of the web UI: a token states a name and a role, signed with a secret that only this launch knows."""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import secrets
from typing import Literal, NamedTuple, get_args

from chefbot.errors import UserError

SECRET_VARIABLE = "CHEFBOT_PAGE_SECRET"
"""Environment variable with the secret that signs tokens. The launch sets it for its own processes, so that a token
outlives the web UI's process; set for the launch, tokens outlive the launch."""
MIN_SECRET = 20
"""Minimum length of a secret that the user sets, characters."""
SIGNATURE_LENGTH = 22
"""Length of a token's signature, characters of 6 bits."""
Role = Literal["guest", "waiter", "manager", "engineer"]
"""Each may do what those before it may; see `roles`."""


class Visitor(NamedTuple):
    """A person or program that uses the web UI; the name is empty for the link that everyone shares."""

    name: str
    role: Role


def is_person(who: str) -> bool:
    """Return whether `who` gave a command is the name of an invited person, not a role or a program."""
    return who not in ("", LOCAL.name, *get_args(Role))


ENGINEER, GUEST = Visitor("", "engineer"), Visitor("", "guest")
LOCAL = Visitor("local", "engineer")
"""Visitor of a web UI that is served to its own computer only, where no token is needed."""


class TokenKey:
    """Issues tokens and checks them; `secret` signs them."""

    def __init__(self, secret: str) -> None:
        self._secret = secret.encode()

    @staticmethod
    def from_environment() -> TokenKey:
        """Return the key of this launch, or a new one. Raises UserError for a secret that could be guessed."""
        secret = os.environ.get(SECRET_VARIABLE, "")
        if secret and len(secret) < MIN_SECRET:
            raise UserError(f"{SECRET_VARIABLE} must have at least {MIN_SECRET} characters")
        return TokenKey(secret or secrets.token_urlsafe(32))

    def token(self, visitor: Visitor) -> str:
        """Return the visitor's token; it is safe in a URL and in a cookie."""
        name, role = visitor
        prefix = "" if visitor == ENGINEER else f"{role}.{name}."
        return prefix + self._signature(visitor)

    def visitor(self, token: str) -> Visitor | None:
        """Return who a token was issued to, or None if it was not issued with this secret."""
        prefix, _, signature = token.rpartition(".")
        role, _, name = prefix.partition(".")
        if prefix and role not in get_args(Role):
            return None
        visitor = Visitor(name, role) if prefix else ENGINEER  # type: ignore[arg-type]
        valid = hmac.compare_digest(signature.encode(), self._signature(visitor).encode())
        return visitor if valid else None

    def _signature(self, visitor: Visitor) -> str:
        text = f"chefbot web UI\0{visitor.role}\0{visitor.name}".encode()
        digest = hmac.new(self._secret, text, hashlib.sha256).digest()
        return base64.urlsafe_b64encode(digest).decode()[:SIGNATURE_LENGTH]


def share_secret() -> None:
    """Set the secret of this launch for processes that it starts: a web UI that starts again accepts the tokens
    that it issued before."""
    os.environ.setdefault(SECRET_VARIABLE, secrets.token_urlsafe(32))

"""This machine's identity in its fleet: what prevents its use, and what its owner should know in time."""

from __future__ import annotations

import os
import shlex
import stat
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.fleet.certificates import CLOCK_TOLERANCE, MEMBER_VALIDITY, CertificateId
from chefbot.fleet.membership import Fleet, Role

RENEWAL_NOTICE = timedelta(days=30)
"""Time before the expiry of a certificate from which on its renewal is recommended."""


class Identity(NamedTuple):
    """This machine's identity in its fleet, and the fleet's members."""

    id: CertificateId
    fleet: Fleet
    authority: Path
    key: Path
    certificate: Path
    begins: datetime
    expires: datetime

    @property
    def name(self) -> str:
        """This machine's name in its fleet."""
        return self.id.name

    @property
    def role(self) -> Role | None:
        """This machine's role; None after its certificate was removed from the fleet or replaced."""
        return self.fleet.members[self.name].role if self.fleet.is_valid(self.id) else None


def check_secret(key: Path) -> None:
    """Raise UserError if other users of this machine can read a private key."""
    try:
        mode = stat.S_IMODE(key.stat().st_mode)
    except OSError:
        return  # the reader of the file reports it
    if os.name == "posix" and mode & 0o077:
        raise UserError(
            f"{key} can be read or written by other users of this machine (mode {mode:o}): "
            f"chmod 600 {shlex.quote(str(key))}"
        )


def check_clock(now: datetime, begins: datetime, fleet: str) -> None:
    """Raise UserError if the clock shows a time before the fleet's creation: no certificate is valid then."""
    if now < begins:
        raise UserError(
            f"this machine's clock shows {now:%Y-%m-%d %H:%M} UTC, before fleet {fleet} was created "
            f"({begins + CLOCK_TOLERANCE:%Y-%m-%d}): set it, for example with `timedatectl set-ntp true`"
        )


def check_validity(me: Identity, now: datetime) -> None:
    """Raise UserError if other machines refuse this machine's certificate, or this one would refuse theirs."""
    check_clock(now, me.begins, me.fleet.name)
    if me.role is None:
        raise UserError(
            f"the certificate of {me.name} is not in list {me.fleet.number} of fleet {me.fleet.name}: it was "
            "removed or replaced; `chefbot fleet renew` requests another, wire:=off runs without other machines"
        )
    if now >= me.expires:
        raise UserError(
            f"the certificate of {me.name} expired on {me.expires:%Y-%m-%d} (this machine's clock: "
            f"{now:%Y-%m-%d}); `chefbot fleet renew` requests another, wire:=off runs without other machines"
        )


def advice(me: Identity, now: datetime) -> str:
    """Return what the owner of a valid certificate should do soon, or an empty string."""
    issued = me.expires - MEMBER_VALIDITY
    if now < issued - CLOCK_TOLERANCE:
        return (
            f"this machine's clock shows {now:%Y-%m-%d}, but its certificate was issued on {issued:%Y-%m-%d}: "
            "set the clock; until then expired certificates are accepted"
        )
    if me.expires - now <= RENEWAL_NOTICE:
        return (
            f"the certificate of {me.name} expires on {me.expires:%Y-%m-%d}, in {(me.expires - now).days} days: "
            "renew it with `chefbot fleet renew`"
        )
    return ""

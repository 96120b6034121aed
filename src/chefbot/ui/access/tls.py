"""TLS of the web UI: the certificate of this machine in its fleet, or one from files."""

from __future__ import annotations

import ssl
from pathlib import Path
from typing import NamedTuple

from cryptography import x509

from chefbot.config import read_bytes
from chefbot.errors import UserError
from chefbot.fleet.keyring import MAX_PEM_BYTES, Keyring, keys_folder

MIN_TLS = ssl.TLSVersion.TLSv1_2
"""Oldest version of TLS that is accepted, whatever the system's OpenSSL permits (RFC 8996)."""
FLEET = "fleet"
"""Value of the parameter `certificate` for the certificate in this machine's key folder."""


class Tls(NamedTuple):
    """A certificate with its private key, as files in PEM format."""

    certificate: Path
    key: Path
    names: tuple[str, ...]
    """Host names that the certificate is valid for."""


def load_tls(certificate: str) -> Tls | None:
    """Return the certificate that the parameter names, or None without one.

    `certificate`: "fleet", or the path of a PEM file; its key is beside it with the ending `.key`. Raises UserError
    if a file is missing or invalid.
    """
    if not certificate:
        return None
    if certificate == FLEET:
        identity = Keyring(keys_folder()).identity()
        path, key = identity.certificate, identity.key
    else:
        path = Path(certificate).expanduser()
        key = path.with_suffix(".key")
    if not key.exists():
        raise UserError(f"the private key of {path} is not at {key}")
    names = _names(path)
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(path, key)
    except (ssl.SSLError, OSError) as error:
        raise UserError(f"{key} is not the private key of {path}: {error.strerror or error}") from None
    return Tls(path, key, names)


def client_context() -> ssl.SSLContext:
    """Return what a client checks a web UI with: the fleet's authority if this machine belongs to a fleet, else the
    authorities of the system (and of the variable SSL_CERT_FILE).

    A member's certificate counts at whichever address it is met, as addresses of robots change.
    """
    ring = Keyring(keys_folder())
    authority = str(ring.identity().authority) if ring.is_member else None
    context = ssl.create_default_context(cafile=authority)
    context.check_hostname = not ring.is_member
    context.minimum_version = MIN_TLS
    return context


def _names(path: Path) -> tuple[str, ...]:
    try:
        certificate = x509.load_pem_x509_certificate(read_bytes(path, "certificate", MAX_PEM_BYTES))
        extension = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return ()
    except ValueError as error:
        raise UserError(f"{path} holds no certificate in PEM format: {error}") from None
    return tuple(extension.value.get_values_for_type(x509.DNSName))

"""X.509 certificates of a fleet with P-256 keys, as Zenoh's TLS reads them.

Zenoh's access control knows a peer by the common name of its certificate only. So a member's common name is
NAME.SERIAL: rules that name it apply to one certificate, not to all that were ever issued for NAME.
"""

from __future__ import annotations

import secrets
from datetime import datetime, timedelta
from typing import NamedTuple

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from chefbot.errors import UserError

AUTHORITY_VALIDITY = timedelta(days=20 * 365)
"""Validity period of the fleet's certificate authority."""
MEMBER_VALIDITY = timedelta(days=365)
"""Validity period of a member's certificate, from its issue."""
CLOCK_TOLERANCE = timedelta(days=1)
"""The authority's certificate is valid from this long before its issue, and all members' from then on too.

A computer without a battery for its clock, such as a Raspberry Pi, starts with the time of its last shutdown.
"""
SERIAL_BITS = 64

_UNREADABLE = (
    ValueError, TypeError, InvalidSignature, UnsupportedAlgorithm, x509.InvalidVersion, x509.DuplicateExtension,
    x509.UnsupportedGeneralNameType,
)  # fmt: skip
"""Exceptions of the library for damaged keys and certificates; parts of them are decoded on access."""

PrivateKey = ec.EllipticCurvePrivateKey


class CertificateId(NamedTuple):
    """What a member's common name consists of."""

    name: str
    serial: str
    """The certificate's serial number, 16 hexadecimal digits."""

    @property
    def common_name(self) -> str:
        """The common name of the certificate."""
        return f"{self.name}.{self.serial}"


def split_common_name(text: str) -> CertificateId:
    """Return the parts of a common name; the serial is empty if it is not a member's."""
    name, _, serial = text.partition(".")
    return CertificateId(name, serial)


def new_key() -> PrivateKey:
    """Generate a private key; it never leaves the machine that made it."""
    return ec.generate_private_key(ec.SECP256R1())


def key_pem(key: PrivateKey) -> bytes:
    """Serialize a private key as PKCS 8, unencrypted: a robot starts without a password prompt."""
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def read_key(pem: bytes, where: str) -> PrivateKey:
    """Load a private key from PEM. Raises UserError if it is not a key on the curve P-256."""
    try:
        key = load_pem_private_key(pem, None)
    except _UNREADABLE:
        key = None
    if not (isinstance(key, ec.EllipticCurvePrivateKey) and isinstance(key.curve, ec.SECP256R1)):
        raise UserError(
            f"{where} holds no private key of a fleet; make another with `chefbot fleet request NAME`"
        )
    return key


def read_certificate(pem: bytes, where: str) -> x509.Certificate:
    """Load a certificate from PEM. Raises UserError if it is not a certificate with a key on the curve P-256."""
    try:
        certificate = x509.load_pem_x509_certificate(pem)
        certificate.subject, certificate.issuer, certificate.extensions  # noqa: B018
        valid = _is_p256(certificate.public_key())
        valid = valid and certificate.not_valid_before_utc < certificate.not_valid_after_utc
    except _UNREADABLE:
        valid = False
    if not valid:
        raise UserError(f"{where} holds no certificate of a fleet; get it again with `chefbot fleet request`")
    return certificate


def certificate_pem(certificate: x509.Certificate) -> bytes:
    """Serialize a certificate as PEM."""
    return certificate.public_bytes(Encoding.PEM)


def authority_certificate(key: PrivateKey, fleet: str, now: datetime) -> x509.Certificate:
    """Return the fleet's self-signed CA certificate; it may sign members but no further CA."""
    name = _name(fleet)
    return (
        _certificate(name, name, key.public_key(), now - CLOCK_TOLERANCE, now + AUTHORITY_VALIDITY)
        .serial_number(x509.random_serial_number())
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )


def request_pem(key: PrivateKey, member: str) -> bytes:
    """Return a member's certificate signing request as PEM; it holds no secret and requests no role."""
    builder = x509.CertificateSigningRequestBuilder().subject_name(_name(member))
    return builder.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)


def read_request(pem: bytes, where: str) -> x509.CertificateSigningRequest:
    """Load a certificate signing request.

    Raises UserError if it is not a request, its signature is invalid or its key is not on the curve P-256.
    """
    try:
        request = x509.load_pem_x509_csr(pem)
        valid, public = request.is_signature_valid, request.public_key()
        request.subject, request.extensions  # noqa: B018
    except _UNREADABLE:
        valid = False
    if not valid:
        raise UserError(f"{where} is not a complete request of `chefbot fleet request`; make it again")
    if not _is_p256(public):
        raise UserError(
            f"{where} is a request for a key of another kind than P-256; make it with `chefbot fleet request`"
        )
    return request


def member_certificate(
    request: x509.CertificateSigningRequest,
    name: str,
    key: PrivateKey,
    authority: x509.Certificate,
    now: datetime,
) -> x509.Certificate:
    """Return the certificate that the authority's `key` issues for a request, for both ends of TLS.

    Of the request only its public key is used. It must come from `read_request`, which checks its signature
    and its kind of key.
    """
    serial = secrets.randbits(SERIAL_BITS) or 1  # zero is not a serial number
    subject = _name(CertificateId(name, _serial_text(serial)).common_name)
    names = [x509.DNSName(name.replace("_", "-")), x509.DNSName(f"{name.replace('_', '-')}.local")]
    uses = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    begin, end = authority.not_valid_before_utc, now + MEMBER_VALIDITY
    public = request.public_key()
    assert isinstance(public, ec.EllipticCurvePublicKey)
    return (
        _certificate(subject, authority.subject, public, begin, end)
        .serial_number(serial)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(key, hashes.SHA256())
    )


def certificate_id(certificate: x509.Certificate) -> CertificateId:
    """Return a certificate's name and serial number."""
    name = split_common_name(common_name(certificate.subject)).name
    return CertificateId(name, _serial_text(certificate.serial_number))


def fingerprint(holder: x509.Certificate | x509.CertificateSigningRequest) -> str:
    """Return the fingerprint of the public key of a certificate or request: 128 bits of its SHA-256, in hex."""
    digest = hashes.Hash(hashes.SHA256())
    digest.update(holder.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo))
    return digest.finalize()[:16].hex()


def is_signed_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """Return whether the authority issued the certificate."""
    try:
        certificate.verify_directly_issued_by(authority)
    except _UNREADABLE:
        return False
    return True


def ecdsa_sign(data: bytes, key: PrivateKey) -> bytes:
    """Sign data with ECDSA over SHA-256."""
    return key.sign(data, ec.ECDSA(hashes.SHA256()))


def is_signature_valid(signature: bytes, data: bytes, authority: x509.Certificate) -> bool:
    """Return whether the signature of the data is the authority's."""
    public = authority.public_key()
    if not isinstance(public, ec.EllipticCurvePublicKey):
        return False
    try:
        public.verify(signature, data, ec.ECDSA(hashes.SHA256()))
    except InvalidSignature:
        return False
    return True


def common_name(name: x509.Name) -> str:
    """Return the common name, or an empty string if there is none."""
    found = name.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if found else ""


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _serial_text(serial: int) -> str:
    return f"{serial:0{SERIAL_BITS // 4}x}"


def _is_p256(key: object) -> bool:
    return isinstance(key, ec.EllipticCurvePublicKey) and isinstance(key.curve, ec.SECP256R1)


def _certificate(
    subject: x509.Name,
    issuer: x509.Name,
    public: ec.EllipticCurvePublicKey,
    begin: datetime,
    end: datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .not_valid_before(begin)
        .not_valid_after(end)
    )

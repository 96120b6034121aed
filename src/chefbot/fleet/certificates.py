"""X.509 certificates of a fleet with P-256 keys, as Zenoh's TLS reads them."""

from __future__ import annotations

from datetime import datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from chefbot.errors import UserError

AUTHORITY_VALIDITY = timedelta(days=20 * 365)
"""Validity period of the fleet's certificate authority."""
MEMBER_VALIDITY = timedelta(days=5 * 365)
"""Validity period of a member's certificate."""
CLOCK_TOLERANCE = timedelta(days=1)
"""Certificates are valid from this long before their issue, as a robot's clock may be slow."""

_UNREADABLE = (
    ValueError, TypeError, InvalidSignature, UnsupportedAlgorithm, x509.InvalidVersion, x509.DuplicateExtension,
    x509.UnsupportedGeneralNameType,
)  # fmt: skip
"""Exceptions of the library for damaged keys and certificates; parts of them are read only when asked for."""

PrivateKey = ec.EllipticCurvePrivateKey


def new_key() -> PrivateKey:
    """Generate a private key; it never leaves the machine that made it."""
    return ec.generate_private_key(ec.SECP256R1())


def key_pem(key: PrivateKey) -> bytes:
    """Serialize a private key as PKCS 8, unencrypted: a robot starts without a password prompt."""
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def read_key(pem: bytes, where: str) -> PrivateKey:
    """Load a private key from PEM. Raises UserError if it is no key on the curve P-256."""
    try:
        key = load_pem_private_key(pem, None)
    except _UNREADABLE:
        key = None
    if not (isinstance(key, ec.EllipticCurvePrivateKey) and isinstance(key.curve, ec.SECP256R1)):
        raise UserError(f"{where} holds no private key of a fleet; make it again with `chefbot fleet`")
    return key


def read_certificate(pem: bytes, where: str) -> x509.Certificate:
    """Load a certificate from PEM. Raises UserError if it is none, or its key or names cannot be read."""
    try:
        certificate = x509.load_pem_x509_certificate(pem)
        certificate.public_key(), certificate.subject, certificate.issuer, certificate.extensions
        return certificate
    except _UNREADABLE:
        raise UserError(f"{where} holds no certificate; ask for it again with `chefbot fleet`") from None


def certificate_pem(certificate: x509.Certificate) -> bytes:
    """Serialize a certificate as PEM."""
    return certificate.public_bytes(Encoding.PEM)


def authority_certificate(key: PrivateKey, fleet: str, now: datetime) -> x509.Certificate:
    """Return the fleet's self-signed CA certificate; it may sign members but no further CA."""
    name = _name(fleet)
    return (
        _certificate(name, name, key.public_key(), now, AUTHORITY_VALIDITY)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )


def request_pem(key: PrivateKey, member: str, role: str) -> bytes:
    """Return a new member's certificate signing request as PEM; it holds no secret."""
    builder = x509.CertificateSigningRequestBuilder().subject_name(_name(member, role))
    return builder.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)


def read_request(pem: bytes, where: str) -> x509.CertificateSigningRequest:
    """Load a certificate signing request.

    Raises UserError if it is none, its signature is invalid or its key is not on the curve P-256.
    """
    try:
        request = x509.load_pem_x509_csr(pem)
        valid, public = request.is_signature_valid, request.public_key()
        request.subject, request.extensions  # noqa: B018
    except _UNREADABLE:
        valid = False
    if not valid:
        raise UserError(
            f"{where} is no whole request of `chefbot fleet robot` or `chefbot fleet operator`; make it again"
        )
    if not (isinstance(public, ec.EllipticCurvePublicKey) and isinstance(public.curve, ec.SECP256R1)):
        raise UserError(
            f"{where} is a request for a key of another kind than P-256; "
            "make it with `chefbot fleet robot` or `chefbot fleet operator`"
        )
    return request


def member_certificate(
    request: x509.CertificateSigningRequest, key: PrivateKey, authority: x509.Certificate, now: datetime
) -> x509.Certificate:
    """Return the certificate that the authority's `key` issues for a request, for both ends of TLS.

    The request must come from `read_request`, which checks its signature and its kind of key.
    """
    member = common_name(request.subject)
    names = [x509.DNSName(member.replace("_", "-")), x509.DNSName(f"{member.replace('_', '-')}.local")]
    uses = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    public = request.public_key()
    assert isinstance(public, ec.EllipticCurvePublicKey)
    return (
        _certificate(request.subject, authority.subject, public, now, MEMBER_VALIDITY)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(key, hashes.SHA256())
    )


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
    """Return the member's name, or an empty string if there is none."""
    return _attribute(name, NameOID.COMMON_NAME)


def requested_role(name: x509.Name) -> str:
    """Return the role that the member requests, or an empty string if there is none."""
    return _attribute(name, NameOID.ORGANIZATIONAL_UNIT_NAME)


def _attribute(name: x509.Name, kind: x509.ObjectIdentifier) -> str:
    found = name.get_attributes_for_oid(kind)
    return str(found[0].value) if found else ""


def _name(text: str, role: str = "") -> x509.Name:
    unit = [x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, role)] if role else []
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text), *unit])


def _certificate(
    subject: x509.Name,
    issuer: x509.Name,
    public: ec.EllipticCurvePublicKey,
    now: datetime,
    validity: timedelta,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_TOLERANCE)
        .not_valid_after(now + validity)
    )

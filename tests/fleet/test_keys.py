"""A fleet's keys: who is let in, what is refused, and that nothing secret leaves its machine."""

from __future__ import annotations

import shlex
import stat
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st
from tests.support.network import admit

from chefbot.errors import UserError
from chefbot.fleet.access_control import access_control, own_keys
from chefbot.fleet.certificates import new_key, read_key, request_pem
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Card, Fleet, Member, Role, check_name
from chefbot.fleet.secure_router import ExternalEndpoints, endpoint, rejection_sentence, router_config

NOW = datetime(2026, 11, 21, tzinfo=UTC)
DAY = timedelta(days=1)


@pytest.fixture
def office(tmp_path: Path) -> Keyring:
    ring = Keyring(tmp_path / "office")
    ring.create_fleet("hotel", NOW)
    return ring


def some_fleet(members: dict[str, Role]) -> Fleet:
    """A list whose members have the serial numbers 0, 1, ..."""
    return Fleet(
        "hotel",
        3,
        {name: Member(role, f"{i:016x}", name, NOW) for i, (name, role) in enumerate(members.items())},
    )


def test_a_member_knows_itself_and_the_others(tmp_path: Path, office: Keyring) -> None:
    me = admit(tmp_path, office, "robot1", "robot", NOW).identity()
    assert (me.name, me.role, me.expires) == ("robot1", "robot", NOW + 365 * DAY)
    assert {name: member.role for name, member in me.fleet.members.items()} == {
        "site": "site",
        "robot1": "robot",
    }
    assert me.fleet.members["robot1"].serial == me.id.serial


def test_private_keys_are_unreadable_for_others_and_never_sent(tmp_path: Path, office: Keyring) -> None:
    robot = Keyring(tmp_path / "robot1")
    request = robot.request_membership("robot1")
    card, _ = office.admit(request, NOW, "robot")
    for ring in (office, robot):
        assert list(ring.folder.glob("*.key"))
        for key in ring.folder.glob("*.key"):
            assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert b"PRIVATE" not in request.read_bytes() + msgspec.json.encode(card) + card.certificate + card.fleet


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o660, 0o602])
def test_a_key_that_others_can_read_is_refused(tmp_path: Path, office: Keyring, mode: int) -> None:
    robot = admit(tmp_path, office, "robot1", "robot", NOW)
    for ring, name, use in (
        (robot, "me.key", lambda: robot.credentials(NOW)),
        (office, "authority.key", lambda: office.remove("robot1")),
    ):
        key = ring.folder / name
        key.chmod(mode)
        with pytest.raises(UserError, match=f"mode {mode:o}") as refusal:
            use()
        command = str(refusal.value).rpartition(": ")[2]
        subprocess.run(shlex.split(command), check=True)
        use()


def test_a_card_for_another_member_updates_only_the_list(tmp_path: Path, office: Keyring) -> None:
    first, second = admit(tmp_path, office, "robot1", "robot", NOW), Keyring(tmp_path / "robot2")
    mine = (first.folder / "me.pem").read_bytes()
    card, _ = office.admit(second.request_membership("robot2"), NOW, "robot")
    assert "robot2" in first.accept(card).members and (first.folder / "me.pem").read_bytes() == mine
    late = Keyring(tmp_path / "late")
    late.request_membership("robot3")
    with pytest.raises(UserError, match="not for this machine's key"):
        late.accept(card)


def test_old_changed_and_foreign_member_lists_are_refused(tmp_path: Path, office: Keyring) -> None:
    robot = admit(tmp_path, office, "robot1", "robot", NOW)
    old = office.card()
    robot.accept(office.remove("robot1"))
    with pytest.raises(UserError, match="older"):
        robot.accept(old)
    assert robot.identity().role is None
    more = msgspec.json.encode(some_fleet({"robot1": "operator"}))
    with pytest.raises(UserError, match="changed"):
        robot.accept(msgspec.structs.replace(old, fleet=more))
    thieves = Keyring(tmp_path / "thieves")
    thieves.create_fleet("hotel", NOW)
    with pytest.raises(UserError, match="another authority"):
        robot.accept(thieves.card())


@given(st.integers(0, 10_000), st.integers(1, 255))
def test_a_damaged_card_is_refused(where: int, flip: int) -> None:
    card = _CARD
    data = bytearray(card.fleet)
    data[where % len(data)] ^= flip
    with pytest.raises(UserError):
        msgspec.structs.replace(card, fleet=bytes(data)).members("the card")


def _some_card() -> Card:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        ring = Keyring(Path(folder))
        ring.create_fleet("hotel", NOW)
        return ring.card()


_CARD = _some_card()


def test_a_robot_may_use_keys_below_its_own_name_only() -> None:
    rules = access_control(some_fleet({"robot1": "robot", "robot10": "robot", "alice": "operator"}), "robot1")
    assert rules["default_permission"] == "deny"
    assert {subject["id"] for subject in rules["subjects"]} == {"this machine", "robot10", "alice"}
    below = next(rule for rule in rules["rules"] if rule["id"] == "below robot10")
    assert below["key_exprs"] == own_keys("robot10")
    assert all("robot10" in key and key.startswith(("*/robot10/", "@ros2_lv/")) for key in below["key_exprs"])


def test_rules_name_certificates_and_not_names() -> None:
    rules = access_control(some_fleet({"robot1": "robot", "alice": "operator"}), "robot1")
    names = [subject["cert_common_names"] for subject in rules["subjects"] if subject["id"] == "alice"]
    assert names == [["alice.0000000000000001"]]


def test_without_keys_nothing_listens_and_tls_is_refused() -> None:
    assert router_config(None, ExternalEndpoints())["listen"]["endpoints"] == []
    with pytest.raises(UserError, match="member of a fleet"):
        router_config(None, ExternalEndpoints(("tls/robot1:7447",)))


@pytest.mark.parametrize(
    "text", ["robot1", "udp/robot1:1", "tls/", "tls/a b", "tls/robot1:port", "tls/x:7447/y"]
)
def test_an_invalid_endpoint_is_reported_in_one_sentence(text: str) -> None:
    with pytest.raises(UserError, match="is not an endpoint"):
        endpoint(text)


def test_an_endpoint_without_a_port_has_the_default_port() -> None:
    assert endpoint("tls/robot1") == "tls/robot1:7447"


@pytest.mark.parametrize(
    "name", ["", "Robot1", "1robot", "robot-1", "a/b", "r*", "%", "x" * 48, "x" * 300, "a.b", "a\n"]
)
def test_invalid_namespaces_are_refused(name: str) -> None:
    with pytest.raises(UserError, match="cannot be a member's name") as refusal:
        check_name(name)
    assert len(str(refusal.value)) < 200


def test_rejections_in_the_zenoh_log_name_the_member() -> None:
    fleet = some_fleet({"robot2": "robot", "robot1": "robot", "alice": "operator"})
    robot2 = f"robot2.{0:016x}"
    who = f"77 on Interface(eth0)+CertCommonName({robot2})+Transport(Tls)+77"
    denied = f"x TRACE a: {who} is unauthorized to Put (ingress) on 0/robot1/cmd_vel"
    assert rejection_sentence(denied, fleet) == "robot2 may not write 0/robot1/cmd_vel"
    node = denied.replace("0/robot1/cmd_vel", "@ros2_lv/0/1b/0/0/NN/%/{}/{}")
    expected = {
        denied
        + "/geometry_msgs::msg::dds_::Twist_/RIHS01_9c/@adv/pub/3e/61/_": "robot2 may not write 0/robot1/cmd_vel",
        node.format("%", "rviz"): "robot2 may not announce node /rviz",
        node.format("%robot1%arm", "base/x"): "robot2 may not announce node /robot1/arm/base",
        node.format("%", "_chefbot_echo_12"): None,
        node.format("%alice", "page"): None,
    }
    for line, sentence in expected.items():
        assert rejection_sentence(line, fleet) == sentence


def test_rejected_certificates_in_the_zenoh_log_are_named() -> None:
    fleet = some_fleet({"robot2": "robot"})
    line = "x DEBUG zenoh_link_tls::unicast: Accepted TLS connection on 10.0.0.1:7447: 10.0.0.2:1. Common Name: {}.\n"
    expected = {
        f"robot2.{0:016x}": None,
        f"robot2.{1:016x}": "a removed or replaced certificate of robot2 was rejected (0000000000000001)",
        "robot2": "a removed or replaced certificate of robot2 was rejected ()",
        f"robot3.{0:016x}": "robot3 is not on the fleet's list",
    }
    for common_name, sentence in expected.items():
        assert rejection_sentence(line.format(common_name), fleet) == sentence


def request_of(key: object, subject: x509.Name, kind: str = "") -> bytes:
    builder = x509.CertificateSigningRequestBuilder().subject_name(subject)
    return builder.sign(key, None if kind == "ed25519" else hashes.SHA256()).public_bytes(Encoding.PEM)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", ["rsa", "p384", "ed25519"])
def test_a_request_for_another_kind_of_key_has_one_sentence(
    kind: str, tmp_path: Path, office: Keyring
) -> None:
    key = {
        "rsa": lambda: rsa.generate_private_key(65537, 2048),
        "p384": lambda: ec.generate_private_key(ec.SECP384R1()),
        "ed25519": ed25519.Ed25519PrivateKey.generate,
    }[kind]()
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "robot1")])
    (tmp_path / "robot1.request").write_bytes(request_of(key, subject, kind))
    with pytest.raises(UserError, match=r"robot1\.request is a request for a key of another kind than P-256"):
        office.admit(tmp_path / "robot1.request", NOW, "robot")
    if kind != "ed25519":
        pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())  # type: ignore[attr-defined]
        with pytest.raises(UserError, match="holds no private key of a fleet"):
            read_key(pem, "a.key")


@pytest.mark.parametrize("wanted", ["operator", "site", "robot"])
def test_the_role_is_chosen_by_the_signer(wanted: str, tmp_path: Path, office: Keyring) -> None:
    """A request with the role that requests of version 0.1 contained, in the organizational unit."""
    unit = x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, wanted)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "robot2"), unit])
    request = tmp_path / "robot2.request"
    request.write_bytes(request_of(new_key(), subject))
    with pytest.raises(UserError, match="choose its role, --role robot or --role operator"):
        office.admit(request, NOW)
    card, _ = office.admit(request, NOW, "robot")
    assert card.members("the card").members["robot2"].role == "robot"


def test_nothing_of_a_request_but_its_key_is_signed(tmp_path: Path, office: Keyring) -> None:
    key = new_key()
    names = x509.SubjectAlternativeName([x509.DNSName("site")])
    authority = x509.BasicConstraints(ca=True, path_length=None)
    builder = x509.CertificateSigningRequestBuilder().subject_name(
        x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "robot2")])
    )
    request = builder.add_extension(names, False).add_extension(authority, True).sign(key, hashes.SHA256())
    (tmp_path / "robot2.request").write_bytes(request.public_bytes(Encoding.PEM))
    card, _ = office.admit(tmp_path / "robot2.request", NOW, "robot")
    certificate = x509.load_pem_x509_certificate(card.certificate)
    assert not certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    signed = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert "site" not in signed.get_values_for_type(x509.DNSName)


@pytest.mark.parametrize("name", ["site", "robot1"])
def test_a_request_for_a_name_in_use_is_refused(name: str, tmp_path: Path, office: Keyring) -> None:
    admit(tmp_path, office, "robot1", "robot", NOW)
    before = office.card()
    request = tmp_path / "x.request"
    request.write_bytes(request_pem(new_key(), name))
    with pytest.raises(UserError, match=f"{name} is a member .* already .* --replace"):
        office.admit(request, NOW, "operator")
    with pytest.raises(UserError, match=f"{name} is a .* choose another name for the operator"):
        office.admit(request, NOW, "operator", replace=True)
    assert office.card() == before

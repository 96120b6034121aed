"""A fleet's keys: who is let in, what is refused, and that nothing secret leaves its machine."""

from __future__ import annotations

import stat
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
from typer.testing import CliRunner

from chefbot.cli.app import app
from chefbot.errors import UserError
from chefbot.fleet.access_control import access_control, own_keys
from chefbot.fleet.certificates import read_key
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Card, Fleet, check_name
from chefbot.fleet.secure_router import ExternalEndpoints, endpoint, rejection_sentence, router_config

NOW = datetime(2026, 11, 21, tzinfo=UTC)


@pytest.fixture
def office(tmp_path: Path) -> Keyring:
    ring = Keyring(tmp_path / "office")
    ring.create_fleet("hotel", NOW)
    return ring


def member(folder: Path, office: Keyring, name: str, role: str = "robot") -> Keyring:
    ring = Keyring(folder / name)
    ring.accept(office.admit(ring.request_membership(name, role), NOW)[0])  # type: ignore[arg-type]
    return ring


def test_a_member_knows_itself_and_the_others(tmp_path: Path, office: Keyring) -> None:
    robot = member(tmp_path, office, "robot1")
    me = robot.identity()
    assert (me.name, me.role, me.fleet.members) == ("robot1", "robot", {"site": "site", "robot1": "robot"})
    assert me.expires - NOW > timedelta(days=365)


def test_private_keys_are_unreadable_for_others_and_never_sent(tmp_path: Path, office: Keyring) -> None:
    robot = Keyring(tmp_path / "robot1")
    request = robot.request_membership("robot1", "robot")
    card, _ = office.admit(request, NOW)
    for ring in (office, robot):
        for key in ring.folder.glob("*.key"):
            assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert b"PRIVATE" not in request.read_bytes() + msgspec.json.encode(card) + card.certificate + card.fleet


def test_a_card_for_another_member_updates_only_the_list(tmp_path: Path, office: Keyring) -> None:
    first, second = member(tmp_path, office, "robot1"), Keyring(tmp_path / "robot2")
    mine = (first.folder / "me.pem").read_bytes()
    card, _ = office.admit(second.request_membership("robot2", "robot"), NOW)
    assert "robot2" in first.accept(card).members and (first.folder / "me.pem").read_bytes() == mine
    late = Keyring(tmp_path / "late")
    late.request_membership("robot3", "robot")
    with pytest.raises(UserError, match="not for this machine's key"):
        late.accept(card)


def test_old_changed_and_foreign_member_lists_are_refused(tmp_path: Path, office: Keyring) -> None:
    robot = member(tmp_path, office, "robot1")
    old = office.card()
    robot.accept(office.remove("robot1"))
    with pytest.raises(UserError, match="older"):
        robot.accept(old)
    assert robot.identity().role is None
    more = msgspec.json.encode(Fleet("hotel", 99, {"robot1": "operator"}))
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
    rules = access_control(
        Fleet("hotel", 3, {"robot1": "robot", "robot10": "robot", "alice": "operator"}), "robot1"
    )
    assert rules["default_permission"] == "deny"
    assert {subject["id"] for subject in rules["subjects"]} == {"this machine", "robot10", "alice"}
    below = next(rule for rule in rules["rules"] if rule["id"] == "below robot10")
    assert below["key_exprs"] == own_keys("robot10")
    assert all("robot10" in key and key.startswith(("*/robot10/", "@ros2_lv/")) for key in below["key_exprs"])


def test_without_keys_nothing_listens_and_tls_is_refused() -> None:
    assert router_config(None, ExternalEndpoints())["listen"]["endpoints"] == []
    with pytest.raises(UserError, match="member of a fleet"):
        router_config(None, ExternalEndpoints(("tls/robot1:7447",)))


@pytest.mark.parametrize(
    "text", ["robot1", "udp/robot1:1", "tls/", "tls/a b", "tls/robot1:port", "tls/x:7447/y"]
)
def test_an_invalid_endpoint_is_one_sentence(text: str) -> None:
    with pytest.raises(UserError, match="is no endpoint"):
        endpoint(text)


def test_an_endpoint_without_a_port_has_the_default_port() -> None:
    assert endpoint("tls/robot1") == "tls/robot1:7447"


@pytest.mark.parametrize("name", ["", "Robot1", "1robot", "robot-1", "a/b", "r*", "%", "x" * 64])
def test_invalid_namespaces_are_refused(name: str) -> None:
    with pytest.raises(UserError, match="cannot be a member's name"):
        check_name(name)


def test_rejections_in_the_zenoh_log_name_the_member() -> None:
    who = "77 on Interface(eth0)+CertCommonName(robot2)+Transport(Tls)+77"
    denied = f"x TRACE a: {who} is unauthorized to Put (ingress) on 0/robot1/cmd_vel"
    assert rejection_sentence(denied, {"robot2": "robot"}) == "robot2 may not write 0/robot1/cmd_vel"
    members = {"robot2": "robot", "robot1": "robot", "alice": "operator"}
    node = denied.replace("0/robot1/cmd_vel", "@ros2_lv/0/1b/0/0/NN/%/{}/{}")
    told = {
        denied
        + "/geometry_msgs::msg::dds_::Twist_/RIHS01_9c/@adv/pub/3e/61/_": "robot2 may not write 0/robot1/cmd_vel",
        node.format("%", "rviz"): "robot2 may not announce node /rviz",
        node.format("%robot1%arm", "base/x"): "robot2 may not announce node /robot1/arm/base",
        node.format("%", "_chefbot_echo_12"): None,
        node.format("%alice", "page"): None,
    }
    for line, sentence in told.items():
        assert rejection_sentence(line, members) == sentence
    ends = "10.0.0.1:7447: 10.0.0.2:1"
    accepted = f"x DEBUG zenoh_link_tls::unicast: Accepted TLS connection on {ends}. Common Name: robot2.\n"
    assert rejection_sentence(accepted, {"robot2": "robot"}) is None
    assert rejection_sentence(accepted, {"robot1": "robot"}) == "robot2 is not on the fleet's list"


def test_the_keys_commands_add_a_robot_to_the_fleet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    def say(*words: str) -> str:
        done = CliRunner().invoke(app, ["fleet", *words], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.output

    say("init", "hotel", "--folder", "office")
    say("robot", "robot1", "--folder", "robot")
    assert "accept robot1.card" in say("sign", "robot/robot1.request", "--folder", "office")
    say("accept", "robot1.card", "--folder", "robot")
    assert "robot1, robot of fleet hotel" in say("show", "--folder", "robot")
    assert "robot1 is no longer a member" in say("remove", "robot1", "--folder", "office")
    with pytest.raises(UserError, match="no member"):
        CliRunner().invoke(app, ["fleet", "remove", "robot9", "--folder", "office"], catch_exceptions=False)


@pytest.mark.parametrize("kind", ["rsa", "p384", "ed25519"])
def test_a_request_for_another_kind_of_key_is_one_sentence(
    kind: str, tmp_path: Path, office: Keyring
) -> None:
    key = {
        "rsa": lambda: rsa.generate_private_key(65537, 2048),
        "p384": lambda: ec.generate_private_key(ec.SECP384R1()),
        "ed25519": ed25519.Ed25519PrivateKey.generate,
    }[kind]()
    subject = x509.Name(
        [
            x509.NameAttribute(NameOID.COMMON_NAME, "robot1"),
            x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, "robot"),
        ]
    )
    builder = x509.CertificateSigningRequestBuilder().subject_name(subject)
    request = builder.sign(key, None if kind == "ed25519" else hashes.SHA256())  # type: ignore[arg-type]
    (tmp_path / "robot1.request").write_bytes(request.public_bytes(Encoding.PEM))
    with pytest.raises(UserError, match=r"robot1\.request is a request for a key of another kind than P-256"):
        office.admit(tmp_path / "robot1.request", NOW)
    if kind != "ed25519":
        pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())  # type: ignore[attr-defined]
        with pytest.raises(UserError, match="holds no private key of a fleet"):
            read_key(pem, "a.key")

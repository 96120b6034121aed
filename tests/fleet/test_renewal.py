"""Renewal, replacement and expiry of certificates, and clocks that are wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from tests.support.network import admit

from chefbot.bridge.membership_health import MembershipHealth
from chefbot.errors import ChefbotError, UserError
from chefbot.fleet import keyring as keyring_module
from chefbot.fleet.certificates import key_pem, read_certificate, read_key
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership_watch import MembershipWatch
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN
from chefbot.ros2.rmw.errors import ErrorCounter

NOW = datetime(2026, 11, 21, tzinfo=UTC)
DAY = timedelta(days=1)


@pytest.fixture
def office(tmp_path: Path) -> Keyring:
    ring = Keyring(tmp_path / "office")
    ring.create_fleet("hotel", NOW)
    return ring


@pytest.fixture
def robot(tmp_path: Path, office: Keyring) -> Keyring:
    return admit(tmp_path, office, "robot1", "robot", NOW)


def renewed(robot: Keyring, office: Keyring, now: datetime) -> None:
    request = robot.renew(now)
    assert request is not None
    robot.accept(office.admit(request, now, replace=True)[0])


def test_renewal_makes_a_new_key_and_another_year(robot: Keyring, office: Keyring) -> None:
    old, old_key = robot.identity(), (robot.folder / "me.key").read_bytes()
    renewed(robot, office, NOW + 340 * DAY)
    me = robot.credentials(NOW + 340 * DAY)
    assert me.expires == NOW + (340 + 365) * DAY and me.name == old.name and me.role == old.role
    assert me.id != old.id and (robot.folder / "me.key").read_bytes() != old_key
    assert not me.fleet.is_valid(old.id) and not (robot.folder / "new.key").exists()


def test_the_old_key_stays_in_use_until_the_card_is_there(robot: Keyring, office: Keyring) -> None:
    before = robot.identity()
    request = robot.renew(NOW)
    assert request is not None and robot.credentials(NOW) == before
    card, _ = office.admit(request, NOW, replace=True)
    assert robot.credentials(NOW) == before
    robot.accept(card)
    assert robot.credentials(NOW).id != before.id


def test_the_authority_renews_itself_at_once(office: Keyring) -> None:
    assert office.renew(NOW + 364 * DAY) is None
    assert office.credentials(NOW + 364 * DAY).expires == NOW + (364 + 365) * DAY


def test_cards_of_a_renewal_may_come_in_any_order(tmp_path: Path, robot: Keyring, office: Keyring) -> None:
    request = robot.renew(NOW)
    assert request is not None
    card, _ = office.admit(request, NOW, replace=True)
    admit(tmp_path, office, "robot2", "robot", NOW)
    robot.accept(office.card())
    assert robot.identity().role is None
    assert robot.accept(card).number == office.card().members("the card").number
    assert robot.credentials(NOW).role == "robot"


def test_an_interrupted_acceptance_can_be_repeated(
    robot: Keyring, office: Keyring, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = robot.renew(NOW)
    assert request is not None
    card, _ = office.admit(request, NOW, replace=True)
    write: Callable[[Path, bytes], None] = keyring_module.write_atomic
    for writes in range(4):
        left = iter(range(writes))

        def write_some(path: Path, data: bytes, left: object = left) -> None:
            if next(left, None) is None:  # type: ignore[call-overload]
                raise OSError
            write(path, data)

        monkeypatch.setattr(keyring_module, "write_atomic", write_some)
        with pytest.raises(OSError):
            robot.accept(card)
        monkeypatch.setattr(keyring_module, "write_atomic", write)
        if writes == 3:
            with pytest.raises(UserError, match="do not belong together: accept this machine's last card"):
                robot.credentials(NOW)
    robot.accept(card)
    me = robot.credentials(NOW)
    certificate = read_certificate(me.certificate.read_bytes(), "me")
    assert read_key(me.key.read_bytes(), "me").public_key() == certificate.public_key()


def test_a_key_that_was_signed_is_never_signed_again(tmp_path: Path, robot: Keyring, office: Keyring) -> None:
    """The stolen robot's request still lies beside the signer's other files when its replacement is signed."""
    old_request = robot.folder / "robot1.request"
    with pytest.raises(UserError, match="for a key that was signed before"):
        office.admit(old_request, NOW, replace=True)
    office.remove("robot1")
    with pytest.raises(UserError, match="for a key that was signed before"):
        office.admit(old_request, NOW, "robot")
    again = admit(tmp_path / "new", office, "robot1", "robot", NOW)
    assert again.credentials(NOW).name == "robot1"
    with pytest.raises(UserError, match="for a key that was signed before"):
        office.admit(old_request, NOW, replace=True)


def test_what_does_not_exist_cannot_be_replaced(tmp_path: Path, office: Keyring) -> None:
    request = Keyring(tmp_path / "robot9").request_membership("robot9")
    with pytest.raises(UserError, match="has no member robot9 whose certificate could be replaced"):
        office.admit(request, NOW, "robot", replace=True)
    with pytest.raises(UserError, match="belongs to no fleet"):
        Keyring(tmp_path / "robot9").renew(NOW)


@pytest.mark.parametrize(
    ("age", "expected"),
    [
        (-2, "clock shows 2026-11-19 00:00 UTC, before fleet hotel was created"),
        (-20_000, "before fleet hotel was created"),
        (0, ""),
        (334, ""),
        (335, "robot1 expires on 2027-11-21, in 30 days: renew it with `chefbot fleet renew`"),
        (364, "in 1 days"),
        (365, "robot1 expired on 2027-11-21 .* `chefbot fleet renew`"),
        (2000, "expired"),
    ],
)
def test_expiry_and_wrong_clocks_are_reported_in_sentences(robot: Keyring, age: int, expected: str) -> None:
    found = robot.warning(NOW + age * DAY)
    assert re.search(expected, found) if expected else found == ""
    if age < -1 or age >= 365:
        with pytest.raises(UserError, match=expected):
            robot.credentials(NOW + age * DAY)
    else:
        robot.credentials(NOW + age * DAY)


def test_a_clock_before_the_issue_is_a_warning_only(tmp_path: Path, office: Keyring) -> None:
    """A Raspberry Pi that was off while its certificate was renewed, and starts without a time server."""
    robot = admit(tmp_path, office, "robot1", "robot", NOW + 300 * DAY)
    assert robot.credentials(NOW + 200 * DAY).role == "robot"
    assert "certificate was issued on 2027-09-17: set the clock" in robot.warning(NOW + 200 * DAY)


def test_a_signer_with_a_clock_before_the_fleet_signs_nothing(tmp_path: Path, office: Keyring) -> None:
    request = Keyring(tmp_path / "robot1").request_membership("robot1")
    with pytest.raises(UserError, match=r"clock shows 1970-01-01 .* before fleet hotel was created"):
        office.admit(request, datetime(1970, 1, 1, tzinfo=UTC), "robot")


def test_a_removed_certificate_is_refused_at_start(robot: Keyring, office: Keyring) -> None:
    robot.accept(office.remove("robot1"))
    with pytest.raises(UserError, match="robot1 is not in list 3 of fleet hotel: it was removed or replaced"):
        robot.credentials(NOW)


def test_a_running_program_takes_over_keys_and_lists(robot: Keyring, office: Keyring) -> None:
    watch, errors = MembershipWatch(robot), ErrorCounter()
    assert not watch.refresh(errors)
    old = watch.identity.id
    renewed(robot, office, NOW + 340 * DAY)
    assert watch.refresh(errors) and watch.identity.id != old and not watch.refresh(errors)
    (robot.folder / "card.json").write_bytes(b"{")
    assert not watch.refresh(errors) and watch.identity.id != old
    assert ["keys changed and cannot be used" in reason for reason in errors.counts()] == [True]
    robot.folder.joinpath("card.json").unlink()
    assert not watch.refresh(errors) and watch.identity.role == "robot"


def test_the_diagnostics_warn_of_expiry_and_removal(robot: Keyring, office: Keyring) -> None:
    health = MembershipHealth(robot)
    levels = [health.status(NOW + age * DAY).level for age in (0, 334, 335, 364, 365)]
    assert levels == [OK, OK, WARN, WARN, ERROR]
    assert health.status(NOW).message == (
        "robot1, robot of fleet hotel, list 2, certificate valid until 2027-11-21"
    )
    renewed(robot, office, NOW + 364 * DAY)
    assert health.status(NOW + 365 * DAY).level == OK
    robot.accept(office.remove("robot1"))
    status = health.status(NOW)
    assert status.level == ERROR and "removed or replaced" in status.message


def test_other_files_than_keys_are_named(robot: Keyring, office: Keyring) -> None:
    (robot.folder / "me.key").write_bytes(key_pem(read_key((office.folder / "me.key").read_bytes(), "k")))
    assert "do not belong together" in robot.warning(NOW)
    (robot.folder / "me.key").unlink()
    with pytest.raises(ChefbotError, match=r"key .*me\.key does not exist"):
        robot.credentials(NOW)

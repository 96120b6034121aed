"""The fleet commands from the first machine to the last, each with a folder of keys of its own."""

from __future__ import annotations

import re
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from tests.support.network import admit

from chefbot.cli.app import main
from chefbot.cli.fleet.keys import (
    accept_card,
    create_fleet,
    remove_member,
    renew_membership,
    request_membership,
    show_identity,
    sign_request,
)
from chefbot.errors import ChefbotError
from chefbot.fleet.keyring import Keyring


@pytest.fixture
def office(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the machine that signs, in a working folder where cards are written."""
    monkeypatch.chdir(tmp_path)
    create_fleet("hotel", tmp_path / "office")
    return tmp_path / "office"


def join(name: str, office: Path, role: str = "robot") -> Path:
    """Let `name` request, sign and accept; return its folder of keys."""
    folder = office.parent / name
    request_membership(name, folder)
    (request,) = folder.glob("*.request")
    sign_request(request, role, False, None, office)
    accept_card(Path(f"{name}.card"), folder)
    return folder


def test_each_step_names_the_next_one(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    join("robot1", office)
    out = capsys.readouterr().out
    for command in ("fleet sign robot1.request --role robot", "fleet accept robot1.card"):
        assert f"chefbot {command}\n" in out, command
    assert "This machine is robot1 of fleet hotel: robot1 (robot), site (site).\n" in out


def test_the_identity_shows_members_and_expiry(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = join("ann", office, "operator")
    capsys.readouterr()
    show_identity(folder)
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("ann, operator of fleet hotel, list ") and first.endswith(
        "ann (operator), site (site)"
    )
    key = Keyring(office).authority_fingerprint()
    assert second.startswith("certificate valid until 20")
    assert second.endswith(f", in {folder}; the authority's key is {key}")


def test_a_removed_member_gets_a_notice(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = join("robot1", office)
    remove_member("robot1", None, office)
    assert "robot1 is no longer a member on machines that have accepted fleet.card" in capsys.readouterr().out
    accept_card(Path("fleet.card"), folder)
    capsys.readouterr()
    show_identity(folder)
    assert capsys.readouterr().out.startswith("robot1, no longer a member of fleet hotel")


def test_a_card_is_written_where_it_is_wanted(office: Path, tmp_path: Path) -> None:
    request_membership("robot1", tmp_path / "robot1")
    (request,) = (tmp_path / "robot1").glob("*.request")
    sign_request(request, "robot", False, tmp_path / "usb.card", office)
    assert (tmp_path / "usb.card").is_file() and not (tmp_path / "robot1.card").exists()


def test_the_folder_of_the_environment_is_the_default(
    office: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CHEFBOT_KEYS", str(office))
    show_identity(None)
    assert "of fleet hotel" in capsys.readouterr().out


def test_requests_and_signatures_show_the_same_key(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    join("robot1", office)
    out = capsys.readouterr().out
    (requested,) = re.findall(r"Key fingerprint: (\w{32})\.", out)
    assert f"with key {requested}." in out
    signed, accepted = re.findall(r"The authority's key is (\w{32})", out)
    assert signed == accepted == Keyring(office).authority_fingerprint() != requested


def test_a_renewal_names_each_step(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = join("robot1", office)
    capsys.readouterr()
    renew_membership(folder)
    assert "chefbot fleet sign robot1.request --replace\n" in capsys.readouterr().out
    sign_request(folder / "robot1.request", "", True, None, office)
    out = capsys.readouterr().out
    assert "refuse the former certificate of robot1" in out and "chefbot fleet accept robot1.card\n" in out
    accept_card(Path("robot1.card"), folder)
    assert "! " not in capsys.readouterr().out


def test_the_authority_renews_in_one_step(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = join("robot1", office)
    renew_membership(office)
    assert "chefbot fleet accept fleet.card\n" in capsys.readouterr().out
    accept_card(Path("fleet.card"), folder)


def test_expiring_members_are_shown(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ring, then = Keyring(office.parent / "old"), datetime.now(UTC) - timedelta(days=340)
    ring.create_fleet("old", then)
    admit(office.parent, ring, "robot7", "robot", then)
    ring.renew(datetime.now(UTC))
    for folder in (ring.folder, office.parent / "robot7"):
        show_identity(folder)
        out = capsys.readouterr().out
        assert "! robot7's certificate is valid until" in out
        assert ("renew it with `chefbot fleet renew`" in out) == (folder != ring.folder)


@pytest.mark.parametrize(
    ("line", "fragment"),
    [
        ("fleet sign robot1/robot1.request --folder office", "robot1 is a member of fleet hotel already"),
        ("fleet sign robot2/robot2.request --folder office", "robot2 is new in fleet hotel: choose its role"),
        ("fleet sign robot2/robot2.request --role chef --folder office", "there is no role 'chef'"),
        ("fleet sign robot2/robot2.request --role robto --folder office", "did you mean 'robot'?"),
        ("fleet sign robot2/robot2.request --role robot --replace --folder office", "has no member robot2"),
        ("fleet sign robot1/robot1.request --replace --folder office", "a key that was signed before"),
        ("fleet sign robot1/robot1.request --role robot --folder robot1", "is not the authority's"),
        ("fleet sign office/card.json --role robot --folder office", "is not a complete request"),
        ("fleet request Robot1 --folder new", "'Robot1' cannot be a member's name"),
        (f"fleet request {'x' * 300} --folder new", "cannot be a member's name"),
        ("fleet request robot3 --folder robot1", "this machine is robot1 already"),
        ("fleet renew --folder new", "belongs to no fleet"),
        ("fleet accept robot1.card --folder new", "no key; `chefbot fleet request NAME` comes first"),
        ("fleet accept robot1/me.pem --folder robot1", "is not a card of a fleet"),
        (
            "fleet remove robot2 --folder office",
            "robot2 is not a member of fleet hotel (did you mean 'robot1'?)",
        ),
        ("fleet init hotel --folder office", "holds keys already"),
        ("fleet init hotel --folder file/x", "file/x"),
    ],
)
def test_bad_input_is_reported_in_one_sentence_with_code_2(
    line: str,
    fragment: str,
    office: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    join("robot1", office)
    request_membership("robot2", office.parent / "robot2")
    Path("file").write_text("")
    before = (office / "card.json").read_bytes()
    capsys.readouterr()
    monkeypatch.setattr(sys, "argv", ["chefbot", *line.split()])
    with pytest.raises(SystemExit) as end:
        main()
    stderr = capsys.readouterr().err
    assert end.value.code == 2 and fragment in stderr, stderr
    assert stderr.startswith("chefbot: ") and stderr.count("\n") == 1 and len(stderr) < 400
    assert (office / "card.json").read_bytes() == before


def test_what_cannot_be_done_is_reported_in_one_sentence(office: Path, tmp_path: Path) -> None:
    (tmp_path / "not.card").write_bytes(b"{")
    for call in (
        lambda: create_fleet("hotel", office),
        lambda: request_membership("../evil", tmp_path / "x"),
        lambda: sign_request(tmp_path / "none.request", "robot", False, None, office),
        lambda: sign_request(tmp_path / "not.card", "robot", False, None, office),
        lambda: accept_card(tmp_path / "not.card", tmp_path / "y"),
        lambda: remove_member("nobody", None, office),
        lambda: remove_member("site", None, tmp_path / "nothing"),
        lambda: show_identity(tmp_path / "nothing"),
    ):
        with pytest.raises(ChefbotError):
            call()
    assert not (tmp_path / "fleet.card").exists()

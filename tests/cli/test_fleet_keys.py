"""The fleet commands from the first machine to the last, each with a folder of keys of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.cli.fleet.keys import (
    accept_card,
    create_fleet,
    remove_member,
    request_membership,
    show_identity,
    sign_request,
)
from chefbot.errors import ChefbotError


@pytest.fixture
def office(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the machine that signs, in a working folder where cards are written."""
    monkeypatch.chdir(tmp_path)
    create_fleet("hotel", tmp_path / "office")
    return tmp_path / "office"


def join(name: str, office: Path, role: str = "robot") -> Path:
    """Let `name` request, sign and accept; return its folder of keys."""
    folder = office.parent / name
    request_membership(name, role, folder)  # type: ignore[arg-type]
    (request,) = folder.glob("*.request")
    sign_request(request, None, office)
    accept_card(Path(f"{name}.card"), folder)
    return folder


def test_each_step_names_the_next_one(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    join("robot1", office)
    out = capsys.readouterr().out
    for command in ("fleet sign robot1.request", "fleet accept robot1.card"):
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
    assert second.startswith("certificate valid until 20") and second.endswith(f", in {folder}")


def test_a_removed_member_is_told_so(office: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = join("robot1", office)
    remove_member("robot1", None, office)
    assert "robot1 is no longer a member on machines that have accepted fleet.card" in capsys.readouterr().out
    accept_card(Path("fleet.card"), folder)
    capsys.readouterr()
    show_identity(folder)
    assert capsys.readouterr().out.startswith("robot1, no longer a member of fleet hotel")


def test_a_card_is_written_where_it_is_wanted(office: Path, tmp_path: Path) -> None:
    request_membership("robot1", "robot", tmp_path / "robot1")
    (request,) = (tmp_path / "robot1").glob("*.request")
    sign_request(request, tmp_path / "usb.card", office)
    assert (tmp_path / "usb.card").is_file() and not (tmp_path / "robot1.card").exists()


def test_the_folder_of_the_environment_is_the_default(
    office: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CHEFBOT_KEYS", str(office))
    show_identity(None)
    assert "of fleet hotel" in capsys.readouterr().out


def test_what_cannot_be_done_is_one_sentence(office: Path, tmp_path: Path) -> None:
    (tmp_path / "not.card").write_bytes(b"{")
    for call in (
        lambda: create_fleet("hotel", office),
        lambda: request_membership("../evil", "robot", tmp_path / "x"),
        lambda: sign_request(tmp_path / "none.request", None, office),
        lambda: sign_request(tmp_path / "not.card", None, office),
        lambda: accept_card(tmp_path / "not.card", tmp_path / "y"),
        lambda: remove_member("nobody", None, office),
        lambda: remove_member("site", None, tmp_path / "nothing"),
        lambda: show_identity(tmp_path / "nothing"),
    ):
        with pytest.raises(ChefbotError):
            call()
    assert not (tmp_path / "fleet.card").exists()

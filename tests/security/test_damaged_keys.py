"""Damaged files of a key folder: each is refused in a sentence, and nothing is changed by it."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.network import admit

from chefbot.errors import ChefbotError
from chefbot.fleet.certificates import read_certificate, read_key, read_request
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Card, read_card

NOW = datetime(2026, 11, 21, tzinfo=UTC)
MUTANTS = 60


def mutant(data: bytes, seed: int) -> bytes:
    """Change, cut, repeat or insert a few bytes."""
    chance = random.Random(seed)
    out = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(out) + 1) if out else 0
        kind = chance.randrange(5)
        if kind == 0 and place < len(out):
            out[place] = chance.randrange(256)
        elif kind == 1:
            del out[place : place + chance.randint(1, 60)]
        elif kind == 2:
            out[place:place] = out[place : place + chance.randint(1, 60)]
        elif kind == 3:
            out[place:place] = chance.randbytes(chance.randint(1, 8))
        else:
            del out[place:]
    return bytes(out)


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    """Key folders of an office and a robot, the robot's card, and a request that was not signed yet."""
    office = Keyring(tmp_path / "office")
    office.create_fleet("hotel", NOW)
    admit(tmp_path, office, "robot1", "robot", NOW)
    shutil.move(Keyring(tmp_path / "robot2").request_membership("robot2"), tmp_path / "robot2.request")
    request = Keyring(tmp_path / "robot1").renew(NOW)
    assert request is not None
    signer = Keyring(tmp_path / "signer")
    shutil.copytree(office.folder, signer.folder)
    (tmp_path / "robot1.card").write_bytes(msgspec.json.encode(signer.admit(request, NOW, replace=True)[0]))
    return tmp_path


def use_of(name: str, folder: Path) -> Callable[[], object]:
    office, robot = Keyring(folder / "office"), Keyring(folder / "robot1")
    return {
        "robot1.card": lambda: robot.accept(read_card(folder / name)[0]),
        "robot2.request": lambda: office.admit(folder / name, NOW, "robot"),
        "robot1/me.pem": lambda: robot.credentials(NOW),
        "robot1/me.key": lambda: robot.credentials(NOW),
        "robot1/card.json": lambda: robot.credentials(NOW),
        "office/authority.pem": lambda: office.admit(folder / "robot2.request", NOW, "robot"),
        "office/authority.key": lambda: office.admit(folder / "robot2.request", NOW, "robot"),
        "office/card.json": lambda: office.admit(folder / "robot2.request", NOW, "robot"),
    }[name]


@pytest.mark.parametrize(
    "name",
    [
        "robot1.card",
        "robot2.request",
        "robot1/me.pem",
        "robot1/me.key",
        "robot1/card.json",
        "office/authority.pem",
        "office/authority.key",
        "office/card.json",
    ],
)
def test_a_damaged_file_is_reported_in_one_sentence(name: str, folders: Path, tmp_path: Path) -> None:
    """Odd mutants that are still valid, as a changed comment outside the PEM, may be accepted."""
    data = (folders / name).read_bytes()
    kept = {path: path.read_bytes() for path in folders.rglob("*") if path.is_file()}
    refused = 0
    for seed in range(MUTANTS):
        (folders / name).write_bytes(mutant(data, seed))
        try:
            use_of(name, folders)()
        except ChefbotError as error:
            refused += 1
            assert "\n" not in str(error) and 20 < len(str(error)) < 400
            assert all(path.read_bytes() == old for path, old in kept.items() if path != folders / name)
        for path, old in kept.items():
            if not path.exists() or path.read_bytes() != old:  # an accepted card consumes a key
                path.write_bytes(old)
    assert refused > 0.8 * MUTANTS


@given(st.binary(max_size=300) | st.text(max_size=300).map(str.encode))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for read in (read_key, read_certificate, read_request):
        with pytest.raises(ChefbotError, match="file x"):
            read(data, "file x")
    with pytest.raises(ChefbotError):
        Card(data, data, data, data).members("card x")


@pytest.mark.parametrize("name", ["me.key", "me.pem", "card.json", "authority.pem"])
def test_a_folder_in_place_of_a_file_is_reported_in_one_sentence(name: str, folders: Path) -> None:
    path = folders / "office" / name
    path.unlink()
    path.mkdir(mode=0o700)
    with pytest.raises(ChefbotError):
        office = Keyring(folders / "office")
        office.credentials(NOW)
        office.remove("robot1")


def test_a_certificate_that_expires_before_it_begins(folders: Path) -> None:
    office = Keyring(folders / "office")
    with pytest.raises(ChefbotError, match="set it"):
        office.admit(folders / "robot2.request", NOW - timedelta(days=800), "robot")

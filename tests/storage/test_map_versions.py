"""Tests of versions of files: each can be brought back, also after a crash at any step, and old ones go."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.storage import map_versions
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.map_versions import NO_CHANGE, ChangeNote, MapVersions, RestoredVersion

TURNED = ChangeNote("a", "The map was rotated by 57°", "Mia", 1.0)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    return tmp_path / "a.yaml", tmp_path / "b.yaml"


def test_a_file_that_did_not_exist_is_removed_again(tmp_path: Path, files: tuple[Path, Path]) -> None:
    versions = MapVersions(tmp_path / "versions", files)
    files[0].write_text("one")
    versions.keep(files, TURNED)
    files[0].write_text("two")
    files[1].write_text("new")
    assert versions.restore().files and files[0].read_text() == "one" and not files[1].exists()
    assert len(versions) == 0 and not versions.restore().files


def test_only_the_newest_versions_are_kept(
    tmp_path: Path, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(map_versions, "MAX_VERSIONS", 3)
    versions = MapVersions(tmp_path / "versions", files)
    for number in range(6):
        files[0].write_text(str(number))
        versions.keep(files, TURNED)
    assert len(versions) == 3
    for expected in ("5", "4", "3"):
        assert versions.restore().files and files[0].read_text() == expected
    assert not versions.restore().files


def test_an_incomplete_version_does_not_count(tmp_path: Path, files: tuple[Path, Path]) -> None:
    """A crash between the copies of two files: bringing such a version back would remove the second."""
    versions = MapVersions(tmp_path / "versions", files)
    for file in files:
        file.write_text("one")
    incomplete = tmp_path / "versions" / "incomplete"
    incomplete.mkdir(parents=True)
    (incomplete / "a.yaml").write_text("half")
    assert len(versions) == 0 and not versions.restore().files
    versions.keep(files, TURNED)
    assert len(versions) == 1 and not incomplete.exists()
    assert versions.restore().files and [file.read_text() for file in files] == ["one", "one"]


def test_a_folder_that_cannot_be_written_has_one_sentence(tmp_path: Path, files: tuple[Path, Path]) -> None:
    (tmp_path / "versions").write_text("a file")
    with pytest.raises(StorageError, match="versions"):
        MapVersions(tmp_path / "versions", files).keep(files, TURNED)


def test_a_version_brings_back_only_what_its_change_concerned(
    tmp_path: Path, files: tuple[Path, Path]
) -> None:
    """The other file was written by somebody else since."""
    versions = MapVersions(tmp_path / "versions", files)
    for file in files:
        file.write_text("one")
    versions.keep(files[:1], TURNED)
    files[0].write_text("two")
    versions.seal()
    files[1].write_text("by hand")
    assert versions.restore() == RestoredVersion([files[0]], TURNED)
    assert [file.read_text() for file in files] == ["one", "by hand"]


def test_the_last_change_is_known_until_it_is_undone(tmp_path: Path, files: tuple[Path, Path]) -> None:
    versions = MapVersions(tmp_path / "versions", files)
    assert versions.last_change() == NO_CHANGE
    versions.keep(files, TURNED)
    assert versions.last_change() == TURNED
    versions.restore()
    assert versions.last_change() == NO_CHANGE


@pytest.mark.parametrize("content", [b"", b"0.0", b'{"rotation": "left"}'])
def test_a_damaged_version_is_named_and_changes_nothing(
    tmp_path: Path, files: tuple[Path, Path], content: bytes
) -> None:
    """Half of a map would be turned back without the rotation that it does not know."""
    versions = MapVersions(tmp_path / "versions", files)
    versions.keep(files, TURNED)
    files[0].write_text("two")
    (tmp_path / "versions" / "000001" / "change.json").write_bytes(content)
    with pytest.raises(StorageError, match=r"000001/change.json is damaged"):
        versions.restore()
    assert files[0].read_text() == "two" and len(versions) == 1

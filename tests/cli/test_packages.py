"""ROS packages on this disk, above a description or installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.cli.robot.packages import home_package, package_folder
from chefbot.errors import ChefbotError, UserError


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with the package `arm_description` in a folder of another name, and an installed `desk`."""
    (tmp_path / "ws" / "arm" / "urdf").mkdir(parents=True)
    (tmp_path / "ws" / "arm" / "package.xml").write_text("<package><name> arm_description </name></package>")
    (tmp_path / "ros" / "share" / "desk").mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/none::{tmp_path}/ros")
    return tmp_path


def find(name: str, disk: Path) -> Path:
    return package_folder(name, disk / "ws" / "arm" / "urdf" / "arm.urdf", "arm.urdf")


def test_a_package_above_the_file_has_the_name_of_its_manifest(disk: Path) -> None:
    assert find("arm_description", disk) == disk / "ws" / "arm"
    with pytest.raises(UserError, match="package arm is not found"):
        find("arm", disk)  # the folder's name does not count where there is a manifest


def test_a_folder_without_a_manifest_is_known_by_its_name(disk: Path) -> None:
    assert find("urdf", disk) == disk / "ws" / "arm" / "urdf"
    assert find("ws", disk) == disk / "ws"


def test_an_installed_package_is_found_behind_those_above(disk: Path) -> None:
    assert find("desk", disk) == disk / "ros" / "share" / "desk"
    (disk / "ros" / "share" / "ws").mkdir()
    assert find("ws", disk) == disk / "ws"


def test_an_unknown_package_is_reported_in_one_sentence(disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UserError, match=r"^arm\.urdf: package nothing is not found; put the file"):
        find("nothing", disk)
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    with pytest.raises(UserError, match="package desk is not found"):
        find("desk", disk)


@pytest.mark.parametrize("name", ["", ".", "..", "../share/desk", "desk/..", "/etc", "desk\n", "desk\0"])
def test_a_name_that_leads_to_another_folder_is_refused(name: str, disk: Path) -> None:
    with pytest.raises(UserError, match="is not a package name"):
        find(name, disk)


def test_a_damaged_manifest_is_reported_with_its_path(disk: Path) -> None:
    manifest = disk / "ws" / "arm" / "package.xml"
    manifest.write_text("<package>")
    with pytest.raises(ChefbotError, match=f"package manifest {manifest}"):
        find("desk", disk)


def test_the_home_of_a_file_is_the_nearest_manifest(disk: Path) -> None:
    file = disk / "ws" / "arm" / "urdf" / "arm.urdf"
    assert home_package(file) == disk / "ws" / "arm"
    (disk / "ws" / "arm" / "urdf" / "package.xml").mkdir()  # a folder is not a manifest
    assert home_package(file) == disk / "ws" / "arm"
    assert home_package(disk / "ros" / "share" / "x.urdf") == disk / "ros" / "share"

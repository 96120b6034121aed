"""`chefbot robot export ros2`: all or nothing, and one sentence for what cannot be."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.support.waiting import PATIENCE

from chefbot.cli.robot import ros2
from chefbot.cli.robot.ros2 import run_ros2
from chefbot.errors import UserError


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small packages, for what is about folders and not about robots."""
    few = {name: {"a/b.txt": name.encode(), "c.txt": b"c"} for name in ("one", "two", "three")}
    monkeypatch.setattr(ros2, "ros2_packages", lambda *_: few)


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")} if folder.exists() else set()


@pytest.mark.usefixtures("quick")
def test_packages_are_created_beside_existing_ones(tmp_path: Path) -> None:
    out = tmp_path / "ws" / "src"
    (out / "mine").mkdir(parents=True)
    (out / "two").mkdir()
    run_ros2("chefbot", out)
    assert {path.name for path in out.iterdir()} == {"mine", "one", "two", "three"}
    assert (out / "two" / "a" / "b.txt").read_text() == "two"


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("taken", ["folder", "file", "link"])
def test_existing_packages_are_not_overwritten(tmp_path: Path, taken: str) -> None:
    place = tmp_path / "three"
    if taken == "folder":
        place.mkdir()
        (place / "my_work.txt").write_text("dear")
    elif taken == "file":
        place.write_text("dear")
    else:
        place.symlink_to(tmp_path / "nowhere")
    before = files(tmp_path)
    with pytest.raises(UserError, match=r"three exists already; move it away"):
        run_ros2("chefbot", tmp_path)
    assert files(tmp_path) == before


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_failure_on_the_way_leaves_nothing_behind(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, real, calls = tmp_path / "new" / "src", os.rename, iter(range(9))

    def fail(source: Path, target: Path) -> None:
        if next(calls) == number:
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr(ros2.os, "rename", fail)
    with pytest.raises(UserError, match=r"cannot be written: No space left on device"):
        run_ros2("chefbot", out)
    assert files(tmp_path) == set()


@pytest.mark.usefixtures("quick")
def test_a_file_or_an_unwritable_folder_as_output_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(UserError, match=r"is a file; give the src folder"):
        run_ros2("chefbot", file)
    with pytest.raises(UserError, match=r"cannot be written"):
        run_ros2("chefbot", file / "src")
    with pytest.raises(UserError, match=r"cannot be written"):
        run_ros2("chefbot", Path("/proc/chefbot_ros2"))


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["chefbto", "--out", "ws"], "no robot is called 'chefbto'"),
        (["gone.yaml", "--out", "ws"], "does not exist"),
    ],
)
def test_an_unknown_robot_is_reported_in_one_sentence(
    tmp_path: Path, arguments: list[str], expected: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "chefbot", "robot", "export", "ros2", *arguments],
        capture_output=True, text=True, cwd=tmp_path, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and expected in done.stderr and "Traceback" not in done.stderr
    assert files(tmp_path) == set()


def test_a_users_robot_is_named_by_its_file(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("like: desk\nname: mine\ndrive: {max_speed: 0.1 m/s}\n")
    run_ros2(str(tmp_path / "mine.yaml"), tmp_path / "src")
    bringup = tmp_path / "src" / "chefbot_bringup"
    assert str(tmp_path / "mine.yaml") in (bringup / "config" / "robot.yaml").read_text()
    assert "vx_max: 0.1 " in (bringup / "config" / "nav2_params.yaml").read_text()

"""The stand-in of `launch` does what ROS 2's actions do (github.com/ros2/launch, launch/launch/actions)."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.design.fake_launch import Started

HEAD = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription
from launch.conditions import UnlessCondition
from launch.substitutions import LaunchConfiguration
def generate_launch_description():
    inner = IncludeLaunchDescription("OUT/robot/launch/inner.launch.py", launch_arguments=ARGUMENTS)
    say = ExecuteProcess(cmd=[LaunchConfiguration("who")])
    return LaunchDescription([ENTITIES])
"""


def launched(
    out: Path, monkeypatch: pytest.MonkeyPatch, outer: str, inner: str, arguments: str = "()"
) -> Started:
    """Run the entities `outer`, which may include the file with the entities `inner`."""
    folder = out / "robot" / "launch"
    folder.mkdir(parents=True)
    for name, entities in (("outer", outer), ("inner", inner)):
        text = HEAD.replace("OUT", str(out)).replace("ARGUMENTS", arguments).replace("ENTITIES", entities)
        (folder / f"{name}.launch.py").write_text(text)
    started = Started(out, monkeypatch)
    started.run(folder / "outer.launch.py", {})
    return started


DECLARED = 'DeclareLaunchArgument("who", default_value="me")'


def test_an_included_file_leaves_its_arguments_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = launched(tmp_path, monkeypatch, "inner, say", DECLARED)
    assert started.commands == [["me"]]
    assert list(started.arguments(tmp_path / "robot/launch/outer.launch.py")) == ["who"]


def test_an_included_file_sees_what_was_set_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    who = 'DeclareLaunchArgument("who", default_value="you")'
    assert launched(tmp_path, monkeypatch, f"{who}, inner", f"{DECLARED}, say").commands == [["you"]]


def test_a_group_keeps_its_arguments_to_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(KeyError, match="who"):
        launched(tmp_path, monkeypatch, "GroupAction([inner]), say", DECLARED)


def test_an_unscoped_group_leaves_its_arguments_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outer = "GroupAction([inner], scoped=False), say"
    assert launched(tmp_path, monkeypatch, outer, DECLARED).commands == [["me"]]


def test_an_include_must_pass_what_has_no_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the including file has a value for it."""
    outer = f'{DECLARED}, GroupAction([inner], condition=UnlessCondition("false"))'
    with pytest.raises(AssertionError, match=r"inner\.launch\.py misses required who"):
        launched(tmp_path, monkeypatch, outer, 'DeclareLaunchArgument("who"), say')


def test_a_passed_argument_goes_before_a_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inner = 'DeclareLaunchArgument("who"), say'
    assert launched(tmp_path, monkeypatch, "inner", inner, '[("who", "them")]').commands == [["them"]]

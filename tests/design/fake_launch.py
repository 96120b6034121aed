"""As much of ROS 2's `launch` and `launch_ros` as our launch files use, to run them and see what they start.

Signatures as in Jazzy: an argument that the real classes do not take fails here too.
"""

from __future__ import annotations

import sys
import types
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class LaunchConfiguration:
    variable_name: str


@dataclass
class EqualsSubstitution:
    left: Any
    right: Any


@dataclass
class FindPackageShare:
    package: str


@dataclass
class PathJoinSubstitution:
    substitutions: list[Any]


@dataclass
class Command:
    command: Any
    on_stderr: str = "fail"


@dataclass
class IfCondition:
    predicate_expression: Any


@dataclass
class UnlessCondition:
    predicate_expression: Any


@dataclass
class DeclareLaunchArgument:
    name: str
    default_value: Any = None
    description: str = ""
    choices: list[str] | None = None
    condition: Any = None


@dataclass
class ExecuteProcess:
    cmd: list[Any]
    output: str = "log"
    prefix: str | None = None
    condition: Any = None


@dataclass
class PythonLaunchDescriptionSource:
    launch_file_path: Any


@dataclass
class IncludeLaunchDescription:
    launch_description_source: PythonLaunchDescriptionSource
    launch_arguments: Any = ()
    condition: Any = None


@dataclass
class Node:
    executable: str
    package: str | None = None
    name: str | None = None
    parameters: list[Any] = field(default_factory=list)
    remappings: list[tuple[str, str]] = field(default_factory=list)
    arguments: list[Any] = field(default_factory=list)
    output: str = "log"
    prefix: str | None = None
    condition: Any = None


@dataclass
class ParameterValue:
    value: Any
    value_type: Any = None


@dataclass
class LaunchDescription:
    entities: list[Any]


MODULES = {
    "launch": [LaunchDescription],
    "launch.actions": [DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription],
    "launch.conditions": [IfCondition, UnlessCondition],
    "launch.launch_description_sources": [PythonLaunchDescriptionSource],
    "launch.substitutions": [Command, EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution],
    "launch_ros": [],
    "launch_ros.actions": [Node],
    "launch_ros.parameter_descriptions": [ParameterValue],
    "launch_ros.substitutions": [FindPackageShare],
    "ament_index_python": [],
}


def run_launch_file(path: Path, workspace: Path, monkeypatch: Any) -> list[Any]:
    """The actions of a launch file, read where no package but the workspace's is installed."""
    for name, members in MODULES.items():
        module = types.ModuleType(name)
        for member in members:
            setattr(module, member.__name__, member)
        monkeypatch.setitem(sys.modules, name, module)
    packages = types.ModuleType("ament_index_python.packages")

    def get_package_share_directory(name: str) -> str:
        if not (workspace / name).is_dir():
            raise LookupError(f"package '{name}' not found")
        return str(workspace / name)

    packages.get_package_share_directory = get_package_share_directory  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "ament_index_python.packages", packages)
    space: dict[str, Any] = {"__file__": str(path)}
    exec(compile(path.read_text(), str(path), "exec"), space)
    return list(space["generate_launch_description"]().entities)


def share(workspace: Path, package: str) -> Path:
    """Where a package is while a launch runs: the workspace's there, others below /opt/ros."""
    return workspace / package if (workspace / package).is_dir() else Path("/opt/ros") / package

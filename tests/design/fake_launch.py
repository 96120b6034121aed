"""As much of ROS 2's `launch` and `launch_ros` as our launch files use, to run them and see what they start.

Signatures and behaviour as in Jazzy: an argument that the real classes do not take fails here too. An included file
sees the launch configurations of the including one and leaves its own behind; a group keeps its own to itself.
"""

from __future__ import annotations

import sys
import types
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest


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
    _: KW_ONLY
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
class IncludeLaunchDescription:
    launch_description_source: Any
    _: KW_ONLY
    launch_arguments: Any = ()
    condition: Any = None


@dataclass
class GroupAction:
    actions: list[Any]
    _: KW_ONLY
    scoped: bool = True
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
    "launch.actions": [DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription],
    "launch.conditions": [IfCondition, UnlessCondition],
    "launch.substitutions": [Command, EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution],
    "launch_ros": [],
    "launch_ros.actions": [Node],
    "launch_ros.parameter_descriptions": [ParameterValue],
    "launch_ros.substitutions": [FindPackageShare],
    "ament_index_python": [],
}


@lru_cache
def compiled(path: Path) -> types.CodeType:
    return compile(path.read_text(), str(path), "exec")


def run_launch_file(path: Path, workspace: Path, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
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
    exec(compiled(path), space)
    return list(space["generate_launch_description"]().entities)


def share(workspace: Path, package: str) -> Path:
    """Where a package is while a launch runs: the workspace's there, others below /opt/ros."""
    return workspace / package if (workspace / package).is_dir() else Path("/opt/ros") / package


def needed(package: Path) -> set[str]:
    """The packages that a manifest lists as needed to run this one."""
    return {one.text or "" for one in ET.parse(package / "package.xml").getroot().iterfind("exec_depend")}


def resolved(value: Any, configurations: dict[str, str], out: Path) -> str:
    """A substitution as text; packages are found in `out`. KeyError for a launch configuration that is not set."""
    if isinstance(value, FindPackageShare):
        return str(share(out, value.package))
    if isinstance(value, PathJoinSubstitution):
        return str(Path(*(resolved(one, configurations, out) for one in value.substitutions)))
    if isinstance(value, (list, tuple)):
        return "".join(resolved(one, configurations, out) for one in value)
    if isinstance(value, LaunchConfiguration):
        return configurations[value.variable_name]
    if isinstance(value, EqualsSubstitution):
        left, right = (resolved(one, configurations, out) for one in (value.left, value.right))
        return str(left == right).lower()
    if isinstance(value, ParameterValue):
        return resolved(value.value, configurations, out)
    return str(value)


def holds(condition: Any, configurations: dict[str, str], out: Path) -> bool:
    """Whether an action with the condition is executed."""
    if condition is None:
        return True
    return (resolved(condition.predicate_expression, configurations, out) == "true") == isinstance(
        condition, IfCondition
    )


class Started:
    """Nodes and processes of a launch file and all that it includes, whose conditions hold."""

    def __init__(self, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.out, self.monkeypatch = out, monkeypatch
        self.configurations: dict[str, str] = {}
        self.nodes: list[tuple[Node, dict[str, str]]] = []
        """Each with the launch configurations at its start."""
        self.commands: list[list[str]] = []
        self.foreign: list[tuple[Path, dict[str, str]]] = []
        """Included files of other workspaces and their arguments."""

    def arguments(self, file: Path) -> dict[str, DeclareLaunchArgument]:
        """What `ros2 launch --show-args` lists: of several declarations of a name the first."""
        listed: dict[str, DeclareLaunchArgument] = {}
        for argument, _ in self.declared(run_launch_file(file, self.out, self.monkeypatch)):
            listed.setdefault(argument.name, argument)
        return listed

    def declared(
        self, entities: list[Any], passed: frozenset[str] = frozenset()
    ) -> Iterator[tuple[DeclareLaunchArgument, frozenset[str]]]:
        """The arguments that can be seen without running, each with the arguments that its include passes.

        A file whose path depends on an argument is not seen.
        """
        for entity in entities:
            if isinstance(entity, DeclareLaunchArgument):
                yield entity, passed
            elif isinstance(entity, GroupAction):
                yield from self.declared(entity.actions, passed)
            elif isinstance(entity, IncludeLaunchDescription):
                try:
                    path = self.path(entity, {})
                except KeyError:
                    continue
                if path.is_relative_to(self.out):
                    inside = run_launch_file(path, self.out, self.monkeypatch)
                    yield from self.declared(inside, passed | {name for name, _ in entity.launch_arguments})

    def path(self, include: IncludeLaunchDescription, configurations: dict[str, str]) -> Path:
        return Path(resolved(include.launch_description_source, configurations, self.out))

    def run(self, file: Path, given: dict[str, str]) -> None:
        """Include a launch file: its arguments become launch configurations, which stay set after it."""
        entities = run_launch_file(file, self.out, self.monkeypatch)
        names = set()
        for argument, passed in self.declared(entities):
            known = argument.name in names | passed | set(given)
            assert known or argument.default_value is not None, f"{file.name} misses required {argument.name}"
            names.add(argument.name)
        assert set(given) <= names, f"{file.name}: unknown arguments {set(given) - names}"
        self.configurations |= given
        self.visit(entities, file)

    def visit(self, entities: list[Any], file: Path) -> None:
        for entity in entities:
            if holds(getattr(entity, "condition", None), self.configurations, self.out):
                self.execute(entity, file)

    def execute(self, entity: Any, file: Path) -> None:
        configurations = self.configurations
        if isinstance(entity, DeclareLaunchArgument):
            self.declare(entity, file)
        elif isinstance(entity, Node):
            self.nodes.append((entity, dict(configurations)))
        elif isinstance(entity, ExecuteProcess):
            self.commands.append([resolved(word, configurations, self.out) for word in entity.cmd])
        elif isinstance(entity, GroupAction):
            if entity.scoped:
                self.configurations = dict(configurations)
            self.visit(entity.actions, file)
            self.configurations = configurations
        elif isinstance(entity, IncludeLaunchDescription):
            self.include(entity, file)

    def declare(self, argument: DeclareLaunchArgument, file: Path) -> None:
        name = argument.name
        if name not in self.configurations:
            assert argument.default_value is not None, f"{file.name}: {name} has no value"
            self.configurations[name] = resolved(argument.default_value, self.configurations, self.out)
        value = self.configurations[name]
        assert not argument.choices or value in argument.choices, (file.name, name, value)

    def include(self, entity: IncludeLaunchDescription, file: Path) -> None:
        path = self.path(entity, self.configurations)
        passed = {
            name: resolved(value, self.configurations, self.out) for name, value in entity.launch_arguments
        }
        package = path.parts[-3]
        assert package == file.parts[-3] or package in needed(file.parents[1]), package
        if path.is_relative_to(self.out):
            self.run(path, passed)
        else:
            self.foreign.append((path, passed))
            self.configurations |= passed

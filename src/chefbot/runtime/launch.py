"""Launch files: the robot, its devices and nodes, and their parameters.

description: Drive a simulated robot with the keyboard.
args: {robot: chefbot, world: hotel}
include: [navigation]
simulated: {include: [simulator, base]}
built: {include: [built_robot]}
nodes:
  teleop: {kind: chefbot.nodes.teleop:TeleopNode, params: {...}, remap: {cmd_vel: cmd_vel_teleop}}
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from chefbot.config import build, parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import LAUNCH, check_kind
from chefbot.runtime.node import Node, params_type
from chefbot.runtime.plugins import class_path

LAUNCH_FOLDER = Path(__file__).parent.parent / "launch"
ArgValue = str | int | float | bool
ClockKind = Literal["simulation", "wall", "robot"]
"""Time source of a launch; `robot`: the time of the robot that this launch joins over the network."""
_HOME_PREFIX = re.compile(r"~[\w.-]*(/|$)")
_PLACEHOLDER = re.compile(r"\$\{(\w+)\}")


class NodeEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The entry of one node in a launch file."""

    kind: Annotated[str, Meta(pattern=r"^[\w.]+(:\w+)?$|^$")] = ""
    """`package.module:Class`, or the name of an entry point in the group `chefbot.nodes`. Empty: overrides
    the given keys of a node from an included launch."""
    params: dict[str, Any] = {}
    remap: dict[str, str] = {}
    process: Annotated[str, Meta(pattern=r"^[a-z_][a-z0-9_]*$|^$")] = ""
    """Name of the process that the node runs in; empty: the launch's own process."""
    host: Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$|^$")] = ""
    """Name of the machine that the node runs on (see `hosts`); empty: the robot."""
    disabled: bool = False
    """Whether the node is left out; meant for arguments such as `headless`."""
    when: dict[str, ArgValue] = {}
    """Arguments and their values without which the node is left out, such as {mapper: graph}."""


STANDARD_ARGS: dict[str, ArgValue] = {
    "robot": "chefbot",
    "seed": 1,
    "duration": 0.0,
    "speed": 1.0,
    "headless": False,
    "record": "",
    "wire": "auto",
    "namespace": "",
}
"""Arguments of every launch, with their defaults.

`seed` is the random seed, `duration` the time to run in seconds (0: until stopped), `speed` the real-time
factor (0: as fast as possible), `headless` disables the web UI, and `record` names a file to record to. Other
processes and ROS 2 can take part if `wire` is `on`, not if it is `off`; `auto` means on unless simulated time
runs as fast as possible. `namespace` is the ROS namespace there (empty: in a fleet the robot's name, else
none)."""


BUILT = "built"
"""Argument of launches that have a part for the built robot: whether that part runs, in wall time, instead of the one
for the simulated robot."""


class LaunchPart(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a launch has for the simulated robot only, or for the built one only; its includes come first."""

    args: dict[str, ArgValue] = {}
    include: list[str] = []
    nodes: dict[str, NodeEntry] = {}


class LaunchFile(LaunchPart, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A launch file as it is written."""

    description: str = ""
    clock: ClockKind = "simulation"
    simulated: LaunchPart = LaunchPart()
    built: LaunchPart | None = None
    """Part for the built robot; None: the launch has no argument `built`."""

    def for_robot(self, built: bool) -> LaunchPart:
        """Return the launch with its part for the built or the simulated robot."""
        part = (self.built or LaunchPart()) if built else self.simulated
        args = {**part.args, **self.args}
        return LaunchPart(
            args=args if self.built is None else {**args, BUILT: built},
            include=[*part.include, *self.include],
            nodes={**part.nodes, **self.nodes},
        )


class Launch(msgspec.Struct, frozen=True, kw_only=True):
    """A launch with its arguments substituted; it can be written to a log and read back."""

    name: str
    description: str
    clock: ClockKind = "simulation"
    args: dict[str, ArgValue]
    nodes: dict[str, NodeEntry]

    def to_json(self) -> str:
        """Return the launch as JSON text for the log."""
        return msgspec.json.encode(self).decode()  # keeps the order of nodes, in which they start

    @staticmethod
    def from_json(text: str) -> Launch:
        """Parse a launch from the JSON text of a log."""
        return msgspec.json.decode(text, type=Launch)


def split_by_process(launch: Launch) -> tuple[Launch, dict[str, Launch]]:
    """Split a launch into the part of its own process and the parts of its other processes by name."""
    parts: dict[str, dict[str, NodeEntry]] = {"": {}}
    for name, entry in launch.nodes.items():
        parts.setdefault(entry.process, {})[name] = entry
    main, *others = (
        (process, msgspec.structs.replace(launch, nodes=nodes)) for process, nodes in parts.items()
    )
    return main[1], dict(others)


def built_in_launches() -> dict[str, Path]:
    """Return the files of the launches that come with the package by name."""
    return {path.stem: path for path in sorted(LAUNCH_FOLDER.glob("*.yaml"))}


def load_launch(name_or_path: str, given: Mapping[str, str] | None = None) -> Launch:
    """Load a launch by name or path, with the values of `key:=value` arguments as texts.

    UserError with file and key if the launch or an argument is invalid.
    """
    path = find_launch(name_or_path)
    built = _parse_argument(path.stem, BUILT, (given or {}).get(BUILT, "false"), False)
    defaults = {**STANDARD_ARGS, **_collect_arguments(path, [], bool(built))}
    arguments = dict(defaults)
    for key, text in (given or {}).items():
        if key not in defaults:
            raise UserError(f"launch {path.stem}: there is no argument {key!r}{name_hint(key, defaults)}")
        arguments[key] = _parse_argument(path.stem, key, text, defaults[key])
    arguments = {key: _expand_home(path.stem, key, value) for key, value in arguments.items()}
    file = _read(path, arguments)
    nodes = _wanted(path.stem, _nodes(path, arguments), arguments)
    clock = "wall" if arguments.get(BUILT) else file.clock
    return Launch(name=path.stem, description=file.description, clock=clock, args=arguments, nodes=nodes)


def _wanted(
    launch: str, entries: Mapping[str, NodeEntry], arguments: Mapping[str, ArgValue]
) -> dict[str, NodeEntry]:
    """Return the nodes that are not left out.

    UserError for a condition on an argument that there is not, or a text that no node's condition has; an empty one
    leaves them all out.
    """
    choices: dict[str, set[ArgValue]] = {}
    for entry in entries.values():
        for name, value in entry.when.items():
            choices.setdefault(name, set()).add(value)
    for name, values in choices.items():
        if name not in arguments:
            raise UserError(
                f"launch {launch}: when: there is no argument {name!r}{name_hint(name, arguments)}"
            )
        given = arguments[name]
        if given and not isinstance(given, bool) and given not in values:
            known = ", ".join(sorted(map(str, values)))
            raise UserError(f"launch {launch}: {name}:={given} must be one of {known}")
    return {
        node: entry
        for node, entry in entries.items()
        if not entry.disabled and all(arguments[name] == value for name, value in entry.when.items())
    }


def find_launch(name_or_path: str) -> Path:
    """Return the file of a launch that is given by name or path."""
    launches = built_in_launches()
    name = name_or_path.removesuffix(".xml").removesuffix(".launch")
    if name in launches:
        return launches[name]
    if "/" in name_or_path or name_or_path.endswith((".yaml", ".yml")):
        return Path(name_or_path)
    raise UserError(f"no launch is called {name_or_path!r}{name_hint(name, launches)}")


def node_class(kind: str, where: str) -> type[Node]:
    """Import the node class that a launch file names; UserError if there is none or it is not a node."""
    module, name = class_path(kind, "chefbot.nodes")
    try:
        node_type = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, TypeError) as error:  # TypeError: a relative name
        raise UserError(f"{where}: {kind!r} cannot be imported: {error}") from None
    if not (isinstance(node_type, type) and issubclass(node_type, Node)):
        raise UserError(f"{where}: {kind!r} is not a node class")
    return node_type


def node_params(kind: type[Node], params: Mapping[str, Any], where: str) -> msgspec.Struct:
    """Parse the parameters of a node and check unknown keys, units and bounds."""
    return build(dict(params), params_type(kind), f"{where}: params")


def checked_node(launch: str, name: str, entry: NodeEntry) -> tuple[type[Node], msgspec.Struct]:
    """Import the class of a launch's node and check its parameters. UserError if either is wrong."""
    where = f"launch {launch}: node {name}"
    kind = node_class(entry.kind, where)
    return kind, node_params(kind, entry.params, where)


def _read(path: Path, arguments: Mapping[str, ArgValue]) -> LaunchFile:
    where = f"launch file {path}"
    content = parse_yaml(read_bytes(path, "launch file"), where)
    if isinstance(content, dict):  # the other part has other arguments
        content.pop("simulated" if arguments.get(BUILT) else "built", None)
    return build(_substitute(content, arguments, where), LaunchFile, where)


def _collect_arguments(path: Path, including: list[Path], built: bool) -> dict[str, ArgValue]:
    """Return the arguments of the file and its includes; the including file's defaults take precedence."""
    if path in including:
        raise UserError(f"launch file {path} includes itself")
    where = f"launch file {path}"
    content = parse_yaml(read_bytes(path, "launch file"), where)
    check_kind(content, LAUNCH, where, UserError)
    part = build(_without_nodes(content), LaunchFile, where).for_robot(built)
    arguments: dict[str, ArgValue] = {}
    for name in part.include:
        arguments.update(_collect_arguments(find_launch(name), [*including, path], built))
    return {**arguments, **part.args}


def _nodes(path: Path, arguments: Mapping[str, ArgValue]) -> dict[str, NodeEntry]:
    """Return the nodes of the file and its includes.

    Disabled nodes are included, as an including file may override them.
    """
    where = f"launch file {path}"
    part = _read(path, arguments).for_robot(bool(arguments.get(BUILT)))
    nodes: dict[str, NodeEntry] = {}
    for name in part.include:
        nodes.update(_nodes(find_launch(name), arguments))
    for name, entry in part.nodes.items():
        nodes[name] = entry if entry.kind else _override(nodes, name, entry, where)
    return nodes


def _override(nodes: Mapping[str, NodeEntry], name: str, entry: NodeEntry, where: str) -> NodeEntry:
    """Return an included node with the overrides of an entry without `kind`.

    Params and remap are merged by key.
    """
    if name not in nodes:
        raise UserError(
            f"{where}: node {name} has no kind, and nothing included is called so{name_hint(name, nodes)}"
        )
    base = nodes[name]
    overrides = {
        field: value for field, value in msgspec.structs.asdict(entry).items() if value != _DEFAULTS[field]
    }
    merged: dict[str, Any] = {
        field: {**getattr(base, field), **overrides[field]}
        for field in ("params", "remap")
        if field in overrides
    }
    return msgspec.structs.replace(base, **{**overrides, **merged})


_DEFAULTS = msgspec.structs.asdict(NodeEntry())


def _substitute(value: Any, arguments: Mapping[str, ArgValue], where: str) -> Any:
    """Substitute `${name}` everywhere; a value that is only a placeholder keeps the argument's type."""
    if isinstance(value, dict):
        return {_substitute(k, arguments, where): _substitute(v, arguments, where) for k, v in value.items()}
    if isinstance(value, list):
        return [_substitute(v, arguments, where) for v in value]
    if not isinstance(value, str):
        return value
    for name in _PLACEHOLDER.findall(value):
        if name not in arguments:
            raise UserError(f"{where}: ${{{name}}} is not among its args{name_hint(name, arguments)}")
    placeholder = _PLACEHOLDER.fullmatch(value)
    if placeholder:
        return arguments[placeholder[1]]
    return _PLACEHOLDER.sub(lambda match: str(arguments[match[1]]), value)


def _without_nodes(value: Any) -> Any:
    """Return the file without its nodes, as they can only be parsed once the arguments are known."""
    if not isinstance(value, dict):
        return value
    parts = {key: _without_nodes(value[key]) for key in ("simulated", "built") if key in value}
    return {**value, **parts, **({"nodes": {}} if isinstance(value.get("nodes"), dict) else {})}


def _parse_argument(launch: str, key: str, text: str, default: ArgValue) -> ArgValue:
    """Convert the text to the type of the argument's default."""
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False, "1": True, "0": False}[text.lower()]
        return type(default)(text)
    except (ValueError, KeyError):
        kind = {bool: "true or false", int: "a whole number", float: "a number"}.get(type(default), "a text")
        raise UserError(f"launch {launch}: {key}:={text} must be {kind}") from None


def _expand_home(launch: str, key: str, value: ArgValue) -> ArgValue:
    """Expand `~/maps/office.yaml` to a path: shells do not expand `~` behind `:=` or within quotes."""
    if not isinstance(value, str) or not _HOME_PREFIX.match(value):
        return value
    try:
        return str(Path(value).expanduser())
    except RuntimeError:
        raise UserError(
            f"launch {launch}: {key}:={value}: there is no home folder {value.split('/')[0]}"
        ) from None

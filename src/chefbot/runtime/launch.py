"""Launch files: which robot, which devices and nodes, which params.

about: Drive a simulated robot with the keyboard.
robot: ${robot}
args: {robot: chefbot, world: hotel}
include: [simulator, base]
nodes:
  teleop: {kind: chefbot.nodes.teleop:TeleopNode, params: {...}, remap: {cmd_vel: cmd_vel_teleop}}
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from chefbot.config import build, parse_yaml, read_bytes
from chefbot.errors import UserError, nearest
from chefbot.runtime.node import Node, params_type

LAUNCH_FOLDER = Path(__file__).parent.parent / "launch"
ArgValue = str | int | float | bool
ClockKind = Literal["simulation", "wall", "robot"]
"""`robot`: whatever time the robot has that this launch joins over the wire."""
_HOME = re.compile(r"~[\w.-]*(/|$)")
_PLACEHOLDER = re.compile(r"\$\{(\w+)\}")


class NodeEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One node of a launch."""

    kind: Annotated[str, Meta(pattern=r"^[\w.]+(:\w+)?$|^$")] = ""
    """`package.module:Class`, or the name of an entry point in the group `chefbot.nodes`. Empty: a node of an
    included launch, of which only what is written here changes."""
    params: dict[str, Any] = {}
    remap: dict[str, str] = {}
    process: Annotated[str, Meta(pattern=r"^[a-z_][a-z0-9_]*$|^$")] = ""
    """Runs in a process of this name, together with others of the same; empty: in the launch's own."""
    host: Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$|^$")] = ""
    """Runs on the machine of this name (see `hosts`); empty: on the robot."""
    unless: bool = False
    """True leaves the node out; for arguments such as `headless`."""


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
"""What every launch understands: which robot, the seed of all chance, seconds to run (0: until stopped), times
real time (0: as fast as may be), without the page, a file to record to, and whether other processes and ROS 2 may
take part: `on`, `off`, or `auto`, which is on unless time runs as fast as may be, and the ROS namespace of all its
names there (empty: in a fleet the robot's name, else none)."""


class LaunchFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A launch file as written."""

    about: str = ""
    clock: ClockKind = "simulation"
    args: dict[str, ArgValue] = {}
    include: list[str] = []
    nodes: dict[str, NodeEntry] = {}


class Launch(msgspec.Struct, frozen=True, kw_only=True):
    """A launch with its arguments put in; can be written to a log and read back."""

    name: str
    about: str
    clock: ClockKind = "simulation"
    args: dict[str, ArgValue]
    nodes: dict[str, NodeEntry]

    def to_json(self) -> str:
        """For the log."""
        return msgspec.json.encode(self).decode()  # the order of nodes is kept: they start in it

    @staticmethod
    def from_json(text: str) -> Launch:
        """From the log."""
        return msgspec.json.decode(text, type=Launch)


def split(launch: Launch) -> tuple[Launch, dict[str, Launch]]:
    """What of it runs in the launch's own process, and what in each of the others."""
    parts: dict[str, dict[str, NodeEntry]] = {"": {}}
    for name, entry in launch.nodes.items():
        parts.setdefault(entry.process, {})[name] = entry
    own, *others = (
        (process, msgspec.structs.replace(launch, nodes=nodes)) for process, nodes in parts.items()
    )
    return own[1], dict(others)


def built_in_launches() -> dict[str, Path]:
    """Name to file of the launches that come with the package."""
    return {path.stem: path for path in sorted(LAUNCH_FOLDER.glob("*.yaml"))}


def load_launch(name_or_path: str, given: Mapping[str, str] | None = None) -> Launch:
    """A launch by name or path, with `key:=value` arguments as texts. UserError with file and key if not."""
    path = find_launch(name_or_path)
    known = {**STANDARD_ARGS, **_collect_args(path, [])}
    arguments = dict(known)
    for key, text in (given or {}).items():
        if key not in known:
            raise UserError(f"launch {path.stem}: there is no argument {key!r}{nearest(key, known)}")
        arguments[key] = _parse_argument(path.stem, key, text, known[key])
    arguments = {key: _from_home(path.stem, key, value) for key, value in arguments.items()}
    file = _read(path, arguments)
    nodes = {node: entry for node, entry in _nodes(path, arguments).items() if not entry.unless}
    return Launch(name=path.stem, about=file.about, clock=file.clock, args=arguments, nodes=nodes)


def find_launch(name_or_path: str) -> Path:
    """The file of a launch."""
    known = built_in_launches()
    name = name_or_path.removesuffix(".xml").removesuffix(".launch")
    if name in known:
        return known[name]
    if "/" in name_or_path or name_or_path.endswith((".yaml", ".yml")):
        return Path(name_or_path)
    raise UserError(f"no launch is called {name_or_path!r}{nearest(name, known)}")


def node_class(kind: str, where: str) -> type[Node]:
    """The class that a launch file names. UserError when it is not there or no node."""
    points = {point.name: point.value for point in entry_points(group="chefbot.nodes")}
    module, _, name = points.get(kind, kind).partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise UserError(f"{where}: {kind!r} cannot be imported: {error}") from None
    if not (isinstance(found, type) and issubclass(found, Node)):
        raise UserError(f"{where}: {kind!r} is not a node class")
    return found


def node_params(kind: type[Node], params: Mapping[str, Any], where: str) -> msgspec.Struct:
    """The params of a node, checked: unknown keys, units, bounds."""
    return build(dict(params), params_type(kind), f"{where}: params")


def _read(path: Path, arguments: Mapping[str, ArgValue]) -> LaunchFile:
    where = f"launch file {path}"
    plain = parse_yaml(read_bytes(path, "launch file"), where)
    return build(_fill(plain, arguments, where), LaunchFile, where)


def _collect_args(path: Path, above: list[Path]) -> dict[str, ArgValue]:
    """Arguments of the file and all that it includes; the including file's default wins."""
    if path in above:
        raise UserError(f"launch file {path} includes itself")
    where = f"launch file {path}"
    plain = parse_yaml(read_bytes(path, "launch file"), where)
    file = build(_without_placeholders(plain), LaunchFile, where)
    arguments: dict[str, ArgValue] = {}
    for name in file.include:
        arguments.update(_collect_args(find_launch(name), [*above, path]))
    return {**arguments, **file.args}


def _nodes(path: Path, arguments: Mapping[str, ArgValue]) -> dict[str, NodeEntry]:
    """Also those that are left out: an including file may still speak of them."""
    file, where = _read(path, arguments), f"launch file {path}"
    nodes: dict[str, NodeEntry] = {}
    for name in file.include:
        nodes.update(_nodes(find_launch(name), arguments))
    for name, entry in file.nodes.items():
        nodes[name] = entry if entry.kind else _changed(nodes, name, entry, where)
    return nodes


def _changed(nodes: Mapping[str, NodeEntry], name: str, entry: NodeEntry, where: str) -> NodeEntry:
    """An included node with what an entry without `kind` says; of params and remap only the keys it names."""
    if name not in nodes:
        raise UserError(
            f"{where}: node {name} has no kind, and nothing included is called so{nearest(name, nodes)}"
        )
    old = nodes[name]
    said = {field: value for field, value in _fields(entry).items() if value != _DEFAULTS[field]}
    merged: dict[str, Any] = {
        field: {**getattr(old, field), **said[field]} for field in ("params", "remap") if field in said
    }
    return msgspec.structs.replace(old, **{**said, **merged})


def _fields(entry: NodeEntry) -> dict[str, Any]:
    return {field: getattr(entry, field) for field in entry.__struct_fields__}


_DEFAULTS = _fields(NodeEntry())


def _fill(value: Any, arguments: Mapping[str, ArgValue], where: str) -> Any:
    """`${name}` replaced everywhere; a value that is nothing else keeps the argument's type."""
    if isinstance(value, dict):
        return {_fill(k, arguments, where): _fill(v, arguments, where) for k, v in value.items()}
    if isinstance(value, list):
        return [_fill(v, arguments, where) for v in value]
    if not isinstance(value, str):
        return value
    for name in _PLACEHOLDER.findall(value):
        if name not in arguments:
            raise UserError(f"{where}: ${{{name}}} is not among its args{nearest(name, arguments)}")
    whole = _PLACEHOLDER.fullmatch(value)
    if whole:
        return arguments[whole[1]]
    return _PLACEHOLDER.sub(lambda match: str(arguments[match[1]]), value)


def _without_placeholders(value: Any) -> Any:
    """The file as far as it can be read before its arguments are known."""
    if isinstance(value, dict) and isinstance(value.get("nodes"), dict):
        return {**value, "nodes": {}}
    return value


def _parse_argument(launch: str, key: str, text: str, default: ArgValue) -> ArgValue:
    """The text in the type of the argument's default."""
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False, "1": True, "0": False}[text.lower()]
        return type(default)(text)
    except (ValueError, KeyError):
        kind = {bool: "true or false", int: "a whole number", float: "a number"}.get(type(default), "a text")
        raise UserError(f"launch {launch}: {key}:={text} must be {kind}") from None


def _from_home(launch: str, key: str, value: ArgValue) -> ArgValue:
    """`~/maps/office.yaml` as a path: shells leave the `~` behind `:=`, and within quotes, as it is."""
    if not isinstance(value, str) or not _HOME.match(value):
        return value
    try:
        return str(Path(value).expanduser())
    except RuntimeError:
        raise UserError(
            f"launch {launch}: {key}:={value}: there is no home folder {value.split('/')[0]}"
        ) from None

"""Pages of launches, nodes with their parameters, and topics and actions, from the launch files and node classes."""

from __future__ import annotations

import inspect
import re
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from chefbot.runtime.launch import STANDARD_ARGS, Launch, built_in_launches, load_launch, node_class
from chefbot.runtime.node import RESTORED_PREFIX, In, Node, Out, TopicSpec, params_type
from generate.api import field_docstrings
from generate.rst import anchor, code, docstring, escape, heading, table, write

_UNITS = (
    *("m/s^2", "m/s", "m/m", "m/rad", "m", "s/rad", "s", "rad/s^2", "rad/s", "rad/rad", "rad/m", "rad"),
    *("1/rad", "1/m", "Hz", "percent", "pixels", "ns"),
)
_UNIT = re.compile(rf"[,(] ?({'|'.join(map(re.escape, _UNITS))})(?=$|[;:,.) ])")


class Port(NamedTuple):
    """One end of a topic or an action in a node class."""

    name: str
    type: str
    role: str
    """publisher, subscription, action server or action client."""
    latched: bool = False


class Parameter(NamedTuple):
    """One leaf of a parameter struct, by its dotted name."""

    name: str
    type: str
    default: Any
    bounds: str
    unit: str
    """1 for a number without dimension; empty for counts, texts and switches."""
    description: str


def launches() -> dict[str, Launch]:
    """Return all built-in launches with their default arguments."""
    return {name: load_launch(name) for name in built_in_launches()}


def node_kinds() -> dict[str, type[Node]]:
    """Return the node classes of all launches, and the one that injects faults, by `module:Class`."""
    kinds = {entry.kind for launch in launches().values() for entry in launch.nodes.values()}
    headful = {"chefbot.ui.web_ui:WebUiDevice"}
    injected = {"chefbot.sim.faults.node_faults:NodeFaultsNode"}
    return {kind: node_class(kind, "docs") for kind in sorted(kinds | headful | injected)}


def ports_of(kind: type[Node]) -> list[Port]:
    """Return all ports of a node class; inputs of restored state are left out."""
    found = []
    for name, hint in typing.get_type_hints(kind).items():
        origin, spec = typing.get_origin(hint), getattr(kind, name, None)
        if origin not in (In, Out):
            continue
        spec = spec if isinstance(spec, TopicSpec) else TopicSpec()
        topic = spec.name or name
        if not topic.startswith((RESTORED_PREFIX, "restarted")):
            role = "subscription" if origin is In else "publisher"
            found.append(Port(topic, ros_type(typing.get_args(hint)[0]), role, spec.latched))
    for name in dir(kind):
        value = getattr(kind, name, None)
        action = getattr(value, "action", None)
        if action is not None and hasattr(value, "bind"):
            role = "action server" if type(value).__name__ == "_ServesSpec" else "action client"
            found.append(Port(value.name or name, _action_type(action), role))
    return sorted(found)


def ros_type(message: Any) -> str:
    """Return the ROS 2 name of a message class, such as sensor_msgs/msg/LaserScan."""
    return f"{message.ros_package()}/msg/{message.__name__}"


def _action_type(action: Any) -> str:
    goal = action.goal
    return f"{goal.ros_package()}/action/{goal.__name__.removesuffix('_Goal')}"


def parameters_of(struct: type[msgspec.Struct], prefix: str = "") -> Iterator[Parameter]:
    """Yield every parameter of a struct; nested structs by dotted names."""
    texts = field_docstrings(struct)
    for field in msgspec.structs.fields(struct):
        name, default = f"{prefix}{field.name}", _default(field)
        base, metas = _unwrapped(field.type)
        if isinstance(base, type) and issubclass(base, msgspec.Struct):
            yield from parameters_of(base, f"{name}.")
            continue
        structs = [one for one in _members(base) if isinstance(one, type) and issubclass(one, msgspec.Struct)]
        description = " ".join(m.description for m in metas if m.description) or texts.get(field.name, "")
        match = _UNIT.search(description)
        unit = match[1] if match else "1" if base is float else ""
        yield Parameter(name, _type_name(base), default, _bounds(metas), unit, description)
        for struct in structs:  # a value or a section
            yield from parameters_of(struct, f"{name}.")


def _default(field: Any) -> Any:
    if field.default is not msgspec.NODEFAULT:
        return field.default
    return field.default_factory() if field.default_factory is not msgspec.NODEFAULT else "required"


def _unwrapped(kind: Any) -> tuple[Any, list[msgspec.Meta]]:
    """Return the type inside `Annotated`, and its msgspec metadata."""
    metas: list[msgspec.Meta] = []
    while typing.get_origin(kind) is typing.Annotated:
        kind, *more = typing.get_args(kind)
        metas += [one for one in more if isinstance(one, msgspec.Meta)]
    return kind, metas


def _members(kind: Any) -> list[Any]:
    """Return the types of a union without their metadata, none for any other type."""
    is_union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    return [_unwrapped(one)[0] for one in typing.get_args(kind)] if is_union else []


def _type_name(kind: Any) -> str:
    if any(isinstance(one, type) and issubclass(one, msgspec.Struct) for one in _members(kind)):
        return " | ".join(_type_name(one) for one in _members(kind))
    if typing.get_origin(kind) is typing.Literal:
        return " | ".join(map(str, typing.get_args(kind)))
    return (
        kind.__name__
        if isinstance(kind, type) and not typing.get_args(kind)
        else str(kind).replace("typing.", "")
    )


def _bounds(metas: list[msgspec.Meta]) -> str:
    signs = {
        "ge": ">=",
        "gt": ">",
        "le": "<=",
        "lt": "<",
        "min_length": "length >=",
        "max_length": "length <=",
    }
    bounds = [
        f"{sign} {getattr(m, key)}"
        for m in metas
        for key, sign in signs.items()
        if getattr(m, key) is not None
    ]
    return ", ".join([*bounds, *(f"matches {m.pattern}" for m in metas if m.pattern)])


def _value(value: Any) -> str:
    """Return a default as it is written in YAML."""
    if isinstance(value, bool):
        return code(str(value).lower())
    return code('""' if value == "" else str(value))


# -- pages


def write_launches(path: Path) -> None:
    """Write the page of all launches with their arguments and nodes."""
    common = [(code(key), _value(value)) for key, value in STANDARD_ARGS.items()]
    parts = [anchor("launches"), heading("Launches"), _STANDARD, table(("argument", "default"), common)]
    for name, launch in launches().items():
        parts += [anchor(f"launch-{name}"), heading(name, "-"), docstring(launch.description or _PART)]
        parts.append(f"Clock: {code(launch.clock)}.\n")
        own = [(code(key), _value(value)) for key, value in launch.args.items() if key not in STANDARD_ARGS]
        parts += [table(("argument", "default"), own)] if own else []
        rows = [
            (code(node), _node_link(entry.kind), code(entry.process), code(entry.host))
            for node, entry in launch.nodes.items()
        ]
        parts += [table(("node", "class", "process", "host"), rows)] if rows else []
    write(path, parts)


_STANDARD = (
    "``chefbot launch NAME key:=value`` runs a launch. "
    "Every launch has the arguments of the first table besides its own.\n"
)
_PART = "A part that other launches include."


def _node_link(kind: str) -> str:
    module, _, name = kind.partition(":")
    return f":ref:`{name} <node-{module}-{name}>`"


def write_nodes(path: Path) -> None:
    """Write the page of all node classes with their ports and parameters."""
    parts = [anchor("nodes"), heading("Nodes and their parameters"), _NODES]
    for kind, node in node_kinds().items():
        module, _, name = kind.partition(":")
        parts += [anchor(f"node-{module}-{name}"), heading(name, "-"), docstring(inspect.getdoc(node) or "")]
        parts.append(f"Named in a launch file as {code(kind)}.\n")
        rows = [(p.role, code(p.name), code(p.type)) for p in ports_of(node)]
        parts += [table(("port", "name", "type"), rows)] if rows else []
        parameters = [
            (
                code(p.name),
                code(p.type),
                _value(p.default),
                code(p.bounds),
                escape(p.unit),
                escape(p.description),
            )
            for p in parameters_of(params_type(node))
        ]
        header = ("parameter", "type", "default", "bounds", "unit", "description")
        parts.append(table(header, parameters) if parameters else "This node has no parameters.\n")
    write(path, parts)


_NODES = (
    "Every node class that a launch names. An unknown parameter or a value out of bounds stops the start. "
    "The unit 1 marks numbers without dimension.\n"
)


def write_topics(path: Path) -> None:
    """Write the page of all topics and actions with their types, publishers and subscribers."""
    topics: dict[tuple[str, str], dict[str, set[str]]] = {}
    for kind, node in node_kinds().items():
        for port in ports_of(node):
            topics.setdefault((port.name, port.type), {}).setdefault(port.role, set()).add(_node_link(kind))

    def rows(infix: str, *roles: str) -> Iterator[tuple[str, ...]]:
        for (name, kind), users in sorted(topics.items()):
            if infix in kind:
                yield code(name), code(kind), *(", ".join(sorted(users.get(role, ()))) for role in roles)

    write(
        path,
        [
            anchor("topics"),
            heading("Topics, actions and services"),
            heading("Topics", "-"),
            table(
                ("topic", "type", "published by", "subscribed by"), rows("/msg/", "publisher", "subscription")
            ),
            heading("Actions", "-"),
            table(("action", "type", "server", "client"), rows("/action/", "action server", "action client")),
            heading("Services", "-"),
            "On the ROS 2 graph each node has the services of a ROS 2 node:\n",
            table(("service", "type"), [(code("/NODE/" + name), code(kind)) for name, kind in _services()]),
        ],
    )


def _services() -> list[tuple[str, str]]:
    """Return the services that the bridge gives each node, with their types."""
    from chefbot.msgs import rcl_interfaces

    names = ("describe_parameters", "get_parameter_types", "get_parameters", "list_parameters")
    names += ("set_parameters", "set_parameters_atomically")
    titles = {name: "".join(word.title() for word in name.split("_")) for name in names}
    known = [(name, f"rcl_interfaces/srv/{title}") for name, title in titles.items()]
    assert all(hasattr(rcl_interfaces, f"{title}_Request") for title in titles.values())
    return [*known, ("get_type_description", "type_description_interfaces/srv/GetTypeDescription")]

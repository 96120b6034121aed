"""Parameter files looked through by the table of names: what ROS 2 would ignore or refuse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tests.design.known_parameters import MPPI, NAMES, ONLY

from chefbot.errors import name_hint

SHAPES = {"collision_monitor": "polygons", "nav2_costmap_2d::ObstacleLayer": "observation_sources"}
Params = Mapping[str, object]


def faults(nodes: Mapping[str, object], distribution: str = "jazzy") -> list[str]:
    """What a parameter file has wrong: names that nobody declares, types that are refused, missing namespaces."""
    found: list[str] = []
    for node, inside in nodes.items():
        while isinstance(inside, Mapping) and "ros__parameters" not in inside and node in inside:
            inside = inside[node]
        if not (isinstance(inside, Mapping) and isinstance(inside.get("ros__parameters"), Mapping)):
            found.append(f"{node}: has no ros__parameters")
            continue
        found += _faults(node, node, inside["ros__parameters"], distribution)
    return found


def _faults(where: str, component: str, params: Params, distribution: str) -> Iterator[str]:
    if component not in NAMES:
        yield f"{where}: {component!r} is unknown{name_hint(component, NAMES)}"
        return
    known = types(component, distribution)
    for name, value in params.items():
        if isinstance(value, Mapping):
            yield from _faults(f"{where}.{name}", _inner(component, name, value, params), value, distribution)
        elif name == "plugin":
            continue
        elif name not in known:
            yield f"{where}: {name!r} is not a parameter{name_hint(name, known)}"
        elif kind(value) != known[name]:
            yield f"{where}: {name} must be {known[name]}, {value!r} is {kind(value)}"
    yield from (f"{where}: {one!r} is listed and not described" for one in _listed(component, params))


def types(component: str, distribution: str) -> dict[str, str]:
    """A component's parameter names and types."""
    text = NAMES[component]
    text = NAMES[text] if text.startswith("@") else text
    found: dict[str, str] = {}
    what = ""
    for word in text.split():
        if word.endswith(":"):
            what = word[:-1]
        else:
            found[word] = what
    for path, (only, what) in ONLY.items():
        owner, _, name = path.rpartition("/")
        if owner == component and only == distribution:
            found[name] = what
        elif owner == component:
            found.pop(name, None)
    return found


def kind(value: object) -> str:
    """The type that ROS 2 gives a YAML value."""
    if isinstance(value, list):
        inner = {kind(one) for one in value}
        return f"{inner.pop()}s" if len(inner) == 1 else "no array of one type"
    for what, name in ((bool, "bool"), (int, "int"), (float, "double"), (str, "string")):
        if isinstance(value, what):
            return name
    return type(value).__name__


def _inner(component: str, name: str, value: Params, params: Params) -> str:
    """The component whose parameters a namespace holds: its plugin, or what the one around it makes of the name."""
    plugin = value.get("plugin")
    if isinstance(plugin, str):
        return plugin
    if component == "collision_monitor":
        polygons = params.get("polygons")
        return f"{component}/{'polygon' if isinstance(polygons, list) and name in polygons else 'source'}"
    named = f"{component}/{name}"
    return named if named in NAMES or component not in SHAPES else f"{component}/source"


LISTS = (
    "plugins", "navigators", "controller_plugins", "progress_checker_plugins", "goal_checker_plugins",
    "planner_plugins", "smoother_plugins", "behavior_plugins", "polygons", "observation_sources",
)  # fmt: skip
"""Whatever these name has a namespace of its own."""


def _listed(component: str, params: Params) -> list[str]:
    names: list[str] = []
    for key in LISTS:
        value = params.get(key, [])
        names += value.split() if isinstance(value, str) else value if isinstance(value, list) else []
    if component == MPPI and isinstance(critics := params.get("critics"), list):
        names += critics
    return [name for name in names if not isinstance(params.get(name), Mapping)]

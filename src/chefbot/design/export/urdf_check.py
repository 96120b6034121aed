"""Validation of a URDF by others: one tree of links with valid masses, shapes and joints."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from chefbot.design.export.urdf_xml import UrdfError
from chefbot.errors import name_hint
from chefbot.robot.geometry.shapes import TENSOR

JOINTS = ("fixed", "continuous", "revolute", "prismatic", "floating", "planar")
SIZES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
}
SLACK = 1e-6
"""Tolerance of the triangle inequality over the largest moment, for rounded numbers."""


class Branch(NamedTuple):
    """A link in the tree: its depth, its mass in kg (0 for a frame) and the type of its joint."""

    depth: int
    link: str
    mass: float
    joint: str


def check_urdf(root: ET.Element, where: str) -> list[Branch]:
    """Return the tree, root first. UrdfError with the first fault that is found."""
    if root.tag != "robot":
        raise UrdfError(f"{where}: its outermost element is <{root.tag}>, not <robot>; that is not URDF")
    links = _links(root, where)
    joints = _joints(root, links, where)
    for name, link in links.items():
        _check_inertial(link, f"{where}: link {name}")
        _check_shapes(link, f"{where}: link {name}")
    return _tree(links, joints, where)


def mesh_names(root: ET.Element) -> list[str]:
    """Return the mesh files of visuals and collisions, each once."""
    return list(dict.fromkeys(mesh.get("filename", "") for mesh in root.iterfind("link/*/geometry/mesh")))


def _links(root: ET.Element, where: str) -> dict[str, ET.Element]:
    links: dict[str, ET.Element] = {}
    for link in root.iterfind("link"):
        name = link.get("name", "")
        if not name:
            raise UrdfError(f"{where}: a link has no name; give it one")
        if name in links:
            raise UrdfError(f"{where}: two links are called {name!r}; rename one")
        links[name] = link
    if not links:
        raise UrdfError(f"{where}: has no link; a robot needs at least one")
    return links


def _joints(root: ET.Element, links: dict[str, ET.Element], where: str) -> dict[str, tuple[str, str]]:
    """Child to (parent, kind of joint)."""
    above: dict[str, tuple[str, str]] = {}
    names: set[str] = set()
    for joint in root.iterfind("joint"):
        name, kind = joint.get("name", ""), joint.get("type", "")
        at = f"{where}: joint {name!r}"
        if not name or name in names:
            raise UrdfError(f"{at}: every joint needs a name of its own")
        names.add(name)
        if kind not in JOINTS:
            raise UrdfError(f"{at}: its type {kind!r} is unknown{name_hint(kind, JOINTS)}")
        parent, child = (_end(joint, tag, links, at) for tag in ("parent", "child"))
        _check_without_parent(child, above, at)
        _numbers(joint.find("origin"), {"xyz": 3, "rpy": 3}, at)
        _check_axis(joint, kind, at)
        above[child] = (parent, kind)
    return above


def _check_without_parent(link: str, above: dict[str, tuple[str, str]], at: str) -> None:
    if link in above:
        raise UrdfError(f"{at}: link {link!r} hangs on {above[link][0]!r} already; a link has one parent")


def _end(joint: ET.Element, tag: str, links: dict[str, ET.Element], at: str) -> str:
    element = joint.find(tag)
    name = "" if element is None else element.get("link", "")
    if name not in links:
        raise UrdfError(f"{at}: its {tag} link {name!r} does not exist{name_hint(name, links)}")
    return name


def _check_axis(joint: ET.Element, kind: str, at: str) -> None:
    axis = _numbers(joint.find("axis"), {"xyz": 3}, at).get("xyz")
    if axis is not None and kind != "fixed" and not any(axis):
        raise UrdfError(f"{at}: its axis is zero; it needs a direction")
    if kind in ("revolute", "prismatic"):
        limit = joint.find("limit")
        if limit is None:
            raise UrdfError(f"{at}: a {kind} joint needs <limit>")
        bounds = _numbers(limit, {"lower": 1, "upper": 1}, at)
        if bounds.get("lower", [0.0])[0] > bounds.get("upper", [0.0])[0]:
            raise UrdfError(f"{at}: its lower limit is above its upper one")


def _numbers(element: ET.Element | None, wanted: dict[str, int], at: str) -> dict[str, list[float]]:
    """Present attributes as finite numbers of the expected count."""
    found = {}
    for key, count in wanted.items():
        text = None if element is None else element.get(key)
        if text is None or element is None:
            continue
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            expected = "a finite number" if count == 1 else f"{count} finite numbers"
            raise UrdfError(f"{at}: {element.tag} {key}={text[:40]!r} must be {expected}")
        found[key] = values
    return found


def _check_inertial(link: ET.Element, at: str) -> None:
    inertial = link.find("inertial")
    if inertial is None:
        return
    _numbers(inertial.find("origin"), {"xyz": 3, "rpy": 3}, at)
    mass = _numbers(inertial.find("mass"), {"value": 1}, at).get("value", [0.0])[0]
    if mass <= 0.0:
        raise UrdfError(f"{at}: its mass is {mass:g} kg; it must be positive")
    tensor = _numbers(inertial.find("inertia"), dict.fromkeys(TENSOR, 1), at)
    missing = [name for name in TENSOR if name not in tensor]
    if missing:
        raise UrdfError(f"{at}: its inertia lacks {missing[0]}")
    _check_tensor(tensor, at)


def _check_tensor(tensor: dict[str, list[float]], at: str) -> None:
    ixx, iyy, izz, ixy, ixz, iyz = (tensor[name][0] for name in TENSOR)
    moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    if moments[0] <= 0.0:
        raise UrdfError(
            f"{at}: its inertia has a principal moment of {moments[0]:.3g} kg m^2; all must be positive"
        )
    if moments[0] + moments[1] < moments[2] * (1.0 - SLACK):
        raise UrdfError(
            f"{at}: its principal moments {moments[0]:.3g}, {moments[1]:.3g} and {moments[2]:.3g} kg m^2 break the "
            "triangle inequality: no body has them"
        )


def _check_shapes(link: ET.Element, at: str) -> None:
    for holder in (*link.iterfind("visual"), *link.iterfind("collision")):
        _numbers(holder.find("origin"), {"xyz": 3, "rpy": 3}, at)
        geometry = holder.find("geometry")
        shapes = [] if geometry is None else list(geometry)
        if len(shapes) != 1:
            raise UrdfError(f"{at}: a {holder.tag} has {len(shapes)} shapes; it needs exactly one")
        _check_size(shapes[0], f"{at}: {holder.tag}")


def _check_size(shape: ET.Element, at: str) -> None:
    if shape.tag == "mesh":
        if not shape.get("filename"):
            raise UrdfError(f"{at}: a mesh names no file")
        return
    if shape.tag not in SIZES:
        raise UrdfError(f"{at}: <{shape.tag}> is not a URDF shape{name_hint(shape.tag, (*SIZES, 'mesh'))}")
    counts = {key: 3 if key == "size" else 1 for key in SIZES[shape.tag]}
    sizes = _numbers(shape, counts, at)
    if set(sizes) != set(counts) or min(value for values in sizes.values() for value in values) <= 0.0:
        raise UrdfError(f"{at}: a {shape.tag} needs {' and '.join(counts)}, all positive")


def _tree(links: dict[str, ET.Element], above: dict[str, tuple[str, str]], where: str) -> list[Branch]:
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        raise UrdfError(
            f"{where}: {roots[0]!r} and {roots[1]!r} hang on nothing; a robot has one root, join them"
        )
    below: dict[str, list[str]] = {}
    for child, (parent, _) in above.items():
        below.setdefault(parent, []).append(child)
    tree = [branch for root in roots for branch in _branches(root, links, above, below)]
    lost = sorted(set(links) - {branch.link for branch in tree})
    if lost:
        raise UrdfError(f"{where}: the joints above link {lost[0]!r} run in a circle; cut it")
    return tree


def _branches(
    root: str, links: dict[str, ET.Element], above: dict[str, tuple[str, str]], below: dict[str, list[str]]
) -> Iterator[Branch]:
    """Depth first, without recursion: a chain may be long."""
    waiting = [(0, root)]
    while waiting:
        depth, name = waiting.pop()
        mass = links[name].find("inertial/mass")
        kind = above[name][1] if name in above else ""
        yield Branch(depth, name, 0.0 if mass is None else float(mass.get("value", 0.0)), kind)
        waiting += [(depth + 1, child) for child in reversed(below.get(name, []))]

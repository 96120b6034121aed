"""Reads and writes behavior trees in the XML of BehaviorTree.CPP 4, as Nav2 and Groot use it.

Both forms of an element are read: `<Sequence name="...">` and `<Control ID="Sequence" name="...">`. Unknown node
types and attributes, scripts and included files are errors that name them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.composites import Composite

from chefbot.behavior_tree.blackboard import BehaviorTreeError, Blackboard, NodePorts, key_of
from chefbot.behavior_tree.catalog import Catalog, NodeKind, NodeType
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.errors import name_hint
from chefbot.strict_xml import parse_xml

FORMAT = "4"
MAX_NODES = 2000
"""Maximum number of nodes with those of all subtrees: subtrees in subtrees can multiply."""
EXPLICIT = {kind.value for kind in NodeKind}
"""Elements that name their type in the attribute ID."""
IGNORED = ("TreeNodesModel",)
"""Elements for editors of trees."""


class TreeFile(NamedTuple):
    """The trees of a file, by ID. main: ID of the one to run. where: the file's name in errors."""

    trees: Mapping[str, ET.Element]
    main: str
    where: str


def read_tree_file(data: bytes, where: str) -> TreeFile:
    """Return the trees of a file; BehaviorTreeError, beginning with `where`, if it is none of BehaviorTree.CPP 4."""
    root = parse_xml(data, where, BehaviorTreeError, "behavior tree")
    _check_root(root, where)
    trees: dict[str, ET.Element] = {}
    for element in root:
        if element.tag == "BehaviorTree":
            name = _required(element, "ID", where)
            if name in trees:
                raise BehaviorTreeError(f"{where}: two trees have the ID {name!r}; rename one")
            trees[name] = element
        elif element.tag not in IGNORED:
            raise BehaviorTreeError(
                f"{where}: <{element.tag}> in <root> is not supported; put all trees here"
            )
    return TreeFile(trees, _main_of(root, trees, where), where)


def _check_root(root: ET.Element, where: str) -> None:
    if root.tag != "root":
        raise BehaviorTreeError(f"{where}: its outermost element is <{root.tag}>, not <root>")
    version = root.get("BTCPP_format")
    if version != FORMAT:
        raise BehaviorTreeError(
            f'{where}: <root> has BTCPP_format={version!r}; write BTCPP_format="{FORMAT}" if it is of that format'
        )


def _main_of(root: ET.Element, trees: Mapping[str, ET.Element], where: str) -> str:
    if not trees:
        raise BehaviorTreeError(f"{where}: has no <BehaviorTree>")
    main = root.get("main_tree_to_execute") or (next(iter(trees)) if len(trees) == 1 else None)
    if main is None:
        raise BehaviorTreeError(
            f"{where}: <root> lacks main_tree_to_execute, which of {len(trees)} trees to run"
        )
    if main not in trees:
        raise BehaviorTreeError(f"{where}: main_tree_to_execute is {main!r}{name_hint(main, trees)}")
    return main


def _required(element: ET.Element, attribute: str, where: str) -> str:
    text = element.get(attribute)
    if not text:
        raise BehaviorTreeError(f"{where}: <{element.tag}> lacks the attribute {attribute}")
    return text


def build_tree(file: TreeFile, catalog: Catalog) -> BehaviorTree:
    """Return the main tree of a file; BehaviorTreeError for what is not in the catalog or contradicts it."""
    builder = _Builder(file, catalog)
    blackboard = Blackboard()
    root = builder.tree(file.main, blackboard, ())
    return BehaviorTree(root, blackboard, builder.types)


class _Builder:
    """Makes the nodes of one tree."""

    def __init__(self, file: TreeFile, catalog: Catalog) -> None:
        self._file, self._catalog = file, catalog
        self.types: dict[int, str] = {}

    def tree(self, name: str, blackboard: Blackboard, inside: tuple[str, ...]) -> Behaviour:
        """Return the root of a tree; `inside` are the IDs of the trees that contain it."""
        if name not in self._file.trees:
            raise BehaviorTreeError(
                f"{self._file.where}: there is no tree with the ID {name!r}{name_hint(name, self._file.trees)}"
            )
        if name in inside:
            raise BehaviorTreeError(f"{self._file.where}: the tree {name!r} contains itself")
        element = self._file.trees[name]
        if len(element) != 1:
            raise BehaviorTreeError(
                f"{self._file.where}: the tree {name!r} has {len(element)} roots; it needs one"
            )
        return self._node(element[0], blackboard, (*inside, name))

    def _node(self, element: ET.Element, blackboard: Blackboard, inside: tuple[str, ...]) -> Behaviour:
        if len(self.types) >= MAX_NODES:
            raise BehaviorTreeError(f"{self._file.where}: has more than {MAX_NODES} nodes")
        if element.tag == "SubTree":
            return self._subtree(element, blackboard, inside)
        where = self._where(element, inside)
        type_name = _required(element, "ID", where) if element.tag in EXPLICIT else element.tag
        node_type = self._type_of(element, type_name, where)
        self._check_attributes(element, node_type, where)
        node = node_type.make(
            element.get("name") or type_name, NodePorts(node_type.ports, element.attrib, blackboard, where)
        )
        self.types[id(node)] = type_name
        self._add_children(node, node_type, element, blackboard, inside)
        return node

    def _type_of(self, element: ET.Element, type_name: str, where: str) -> NodeType:
        explicit = element.tag in EXPLICIT
        node_type = self._catalog.get(type_name)
        if node_type is None or (explicit and node_type.kind.value != element.tag):
            kind = f"{element.tag} " if explicit else ""
            names = [one for one, t in self._catalog.items() if not explicit or t.kind.value == element.tag]
            raise BehaviorTreeError(
                f"{where}: the {kind}node {type_name!r} is unknown{name_hint(type_name, names)}"
            )
        return node_type

    def _add_children(
        self,
        node: Behaviour,
        node_type: NodeType,
        element: ET.Element,
        blackboard: Blackboard,
        inside: tuple[str, ...],
    ) -> None:
        low, high = node_type.children
        if not low <= len(element) <= high:
            wanted = f"{low}" if low == high else f"{low} or more"
            raise BehaviorTreeError(
                f"{self._where(element, inside)}: has {len(element)} children; it needs {wanted}"
            )
        if isinstance(node, Composite):
            node.add_children([self._node(child, blackboard, inside) for child in element])

    def _subtree(self, element: ET.Element, blackboard: Blackboard, inside: tuple[str, ...]) -> Behaviour:
        """Return the root of a subtree; its attributes give its keys, as keys of this tree or as texts."""
        given = {
            name: text for name, text in element.attrib.items() if name not in ("ID", "name", "_autoremap")
        }
        hidden = [name for name in given if name.startswith("_")]
        if hidden:
            raise BehaviorTreeError(f"{self._where(element, inside)}: {hidden[0]} is not supported")
        remapped = {name: key for name, text in given.items() if (key := key_of(text)) is not None}
        autoremap = element.get("_autoremap", "false").lower() in ("true", "1")
        scope = Blackboard(blackboard, remapped, autoremap=autoremap)
        for name in given.keys() - remapped.keys():
            scope.set(name, given[name])
        return self.tree(_required(element, "ID", self._where(element, inside)), scope, inside)

    def _check_attributes(self, element: ET.Element, node_type: NodeType, where: str) -> None:
        known = {"name", *(port.name for port in node_type.ports)}
        known |= {"ID"} if element.tag in EXPLICIT else set()
        for name in element.attrib:
            if name not in known:
                raise BehaviorTreeError(f"{where}: the attribute {name!r} is unknown{name_hint(name, known)}")

    def _where(self, element: ET.Element, inside: tuple[str, ...]) -> str:
        name = element.get("name")
        return (
            f"{self._file.where}: {inside[-1]}/{element.get('ID', element.tag)}{f' {name!r}' if name else ''}"
        )


def write_tree(tree: BehaviorTree, catalog: Catalog, name: str = "MainTree") -> bytes:
    """Return the XML of a tree with a model of its node types, as Groot needs it to show it.

    Subtrees are written where they are used.
    """
    root = ET.Element("root", BTCPP_format=FORMAT, main_tree_to_execute=name)
    ET.SubElement(root, "BehaviorTree", ID=name).append(_element(tree, tree.root))
    model = ET.SubElement(root, "TreeNodesModel")
    for type_name in sorted({tree.type_of(node) for node in tree.root.iterate()}):
        model.append(_model(type_name, catalog[type_name]))
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _element(tree: BehaviorTree, node: Behaviour) -> ET.Element:
    type_name = tree.type_of(node)
    element = ET.Element(type_name, {"name": node.name} if node.name != type_name else {})
    ports = getattr(node, "ports", None)
    if isinstance(ports, NodePorts):
        for name, text in ports.given.items():
            element.set(name, text)
    element.extend(_element(tree, child) for child in node.children)
    return element


def _model(type_name: str, node_type: NodeType) -> ET.Element:
    element = ET.Element(node_type.kind.value, ID=type_name)
    for port in node_type.ports:
        tag = "output_port" if port.direction == "output" else "input_port"
        default = {} if port.default is None else {"default": port.default}
        ET.SubElement(element, tag, {"name": port.name, **default})
    return element

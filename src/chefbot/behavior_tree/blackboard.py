"""Values that the nodes of a behavior tree share, and the ports through which a node reads and writes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from chefbot.errors import ChefbotError, name_hint


class BehaviorTreeError(ChefbotError):
    """A behavior tree that cannot run; the message names file, node and port."""


class Blackboard:
    """Named values of one tree. A subtree has a blackboard of its own whose keys can be those of its parent.

    remapped: keys of this blackboard and the keys of `parent` that they stand for. autoremap: whether every other
    key stands for the same key of `parent`.
    """

    def __init__(
        self,
        parent: Blackboard | None = None,
        remapped: Mapping[str, str] | None = None,
        *,
        autoremap: bool = False,
    ) -> None:
        self._values: dict[str, object] = {}
        self._parent, self._remapped, self._autoremap = parent, dict(remapped or {}), autoremap
        self._now_ns = 0

    @property
    def now_ns(self) -> int:
        """Time of the present tick, ns."""
        return self._parent.now_ns if self._parent is not None else self._now_ns

    @now_ns.setter
    def now_ns(self, value: int) -> None:
        self._now_ns = value

    def get(self, key: str) -> object:
        """Return a value; BehaviorTreeError if no node has written it yet."""
        home, name = self._home_of(key)
        if name not in home._values:
            raise BehaviorTreeError(f"the blackboard has no {key!r}{name_hint(name, home._values)}")
        return home._values[name]

    def find(self, key: str) -> object | None:
        """Return a value, or None if no node has written it yet."""
        home, name = self._home_of(key)
        return home._values.get(name)

    def set(self, key: str, value: object) -> None:
        """Write a value at a key, or at the key to which it is remapped."""
        home, name = self._home_of(key)
        home._values[name] = value

    def _home_of(self, key: str) -> tuple[Blackboard, str]:
        """Return the blackboard that has the value, and its key there."""
        if self._parent is not None and key in self._remapped:
            return self._parent._home_of(self._remapped[key])
        if self._parent is not None and self._autoremap:
            return self._parent._home_of(key)
        return self, key


class NodePort(NamedTuple):
    """A port of a node type: an attribute of its XML element.

    kind: type of its value; `object` for what only the blackboard can have, as a path. direction: `input` or
    `output`. default: text without the attribute; None if the attribute is required. minimum: of a number.
    """

    name: str
    kind: type
    direction: str = "input"
    default: str | None = None
    minimum: float = -math.inf


def key_of(text: str) -> str | None:
    """Return the blackboard key of a port's text, such as `goal` of `{goal}`; None if the text is a value itself."""
    return text[1:-1].strip() if text.startswith("{") and text.endswith("}") else None


def parse_value(port: NodePort, text: str, where: str) -> object:
    """Return the value that a text has for a port; BehaviorTreeError, beginning with `where`, if it is none."""
    if port.kind is object:
        raise BehaviorTreeError(
            f"{where}: {port.name} is {text!r}; it must be a blackboard key, as in {{key}}"
        )
    if port.kind is str:
        return text
    try:
        number = port.kind(text)
    except (ValueError, OverflowError):
        number = math.nan
    if not (math.isfinite(number) and number >= port.minimum):
        bound = f" of at least {port.minimum:g}" if math.isfinite(port.minimum) else ""
        raise BehaviorTreeError(f"{where}: {port.name} is {text!r}; it must be a number{bound}")
    return number


class NodePorts:
    """The ports of one node.

    texts: by name, the attributes of the node's element. where: names the node in errors.
    """

    def __init__(
        self, ports: tuple[NodePort, ...], texts: Mapping[str, str], blackboard: Blackboard, where: str
    ) -> None:
        self.blackboard, self.where = blackboard, where
        self._ports = {port.name: port for port in ports}
        self.given = {port.name: texts[port.name] for port in ports if port.name in texts}
        """The attributes that the element has."""
        self.texts = {port.name: texts.get(port.name, port.default) for port in ports}
        for port in ports:
            self._check(port)

    def _check(self, port: NodePort) -> None:
        text = self.texts[port.name]
        if text is None:
            raise BehaviorTreeError(f"{self.where}: the attribute {port.name} is missing")
        if text and key_of(text) is None:
            if port.direction == "output":
                raise BehaviorTreeError(
                    f"{self.where}: {port.name} is {text!r}; an output must be a blackboard key, as in {{key}}"
                )
            parse_value(port, text, self.where)

    def value(self, name: str) -> object:
        """Return the value of an input; BehaviorTreeError if it is a key that no node has written yet."""
        text, port = self.texts[name] or "", self._ports[name]
        key = key_of(text)
        if key is None:
            return parse_value(port, text, self.where)
        found = self.blackboard.get(key)
        return parse_value(port, found, self.where) if isinstance(found, str) else found

    def number(self, name: str) -> float:
        """Return the value of an input that is a number."""
        value = self.value(name)
        if not isinstance(value, int | float):
            raise BehaviorTreeError(f"{self.where}: {name} is {value!r}, which is not a number")
        return float(value)

    def text(self, name: str) -> str:
        """Return the value of an input that is a text."""
        return str(self.value(name))

    def write(self, name: str, value: object) -> None:
        """Write an output; nothing happens if the element does not have it."""
        key = key_of(self.texts[name] or "")
        if key is not None:
            self.blackboard.set(key, value)

"""The arithmetic of xacro's `${...}`, evaluated over the syntax tree; no Python code of the file is ever run.

xacro itself hands expressions to Python's `eval` behind a filter of names, which a comprehension passes. Here a
node type, a function or a size that is not listed is refused with a sentence.
"""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from chefbot.design.export.xacro_text import (
    DICT_METHODS,
    MAX_STRING,
    TEXT_METHODS,
    RefusedError,
    filled,
    formatted,
)

MAX_TEXT = 10_000
"""Characters of an expression."""
MAX_ITEMS = 10_000
"""Items of a list that an expression may make."""
MAX_BITS = 1024
"""Maximum bits of an integer, about those of the largest float."""
MAX_DIGITS = 300
"""Digits to which a number may be rounded, before or behind the point."""
_UNBOUNDED = ("factorial", "comb", "perm", "prod", "lcm")
_BUILTINS = (
    "list", "dict", "len", "str", "float", "int", "bool", "min", "max", "round", "sorted", "range",
    "abs", "all", "any", "divmod", "sum", "tuple", "ord",
)  # fmt: skip
_ITERATORS = ("enumerate", "reversed", "zip")
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos, ast.USub: operator.neg, ast.Not: operator.not_,
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
    ast.In: lambda a, b: a in b, ast.NotIn: lambda a, b: a not in b,
}  # fmt: skip
_VALUES = (bool, int, float, str, list, tuple, dict, range, type(None))


class Function(NamedTuple):
    """A function that an expression may call; it is never a value."""

    name: str
    call: Callable[..., Any]


def builtin_functions() -> dict[str, Function]:
    """Return Python's functions without side effects; those with iterators return lists."""
    found = {name: Function(name, getattr(builtins, name)) for name in _BUILTINS}
    found |= {name: Function(name, _listed(getattr(builtins, name))) for name in _ITERATORS}
    return found | {"round": Function("round", _round)}


def _round(number: Any, ndigits: int | None = None) -> Any:
    if ndigits is not None and abs(ndigits) > MAX_DIGITS:
        raise RefusedError(f"round to {ndigits} digits: {MAX_DIGITS} is the maximum")
    return round(number, ndigits)


def _listed(iterator: Callable[..., Any]) -> Callable[..., list[Any]]:
    return lambda *given: list(iterator(*given))


def math_names() -> dict[str, Function | float]:
    """Return the constants and functions of `math`, except those whose results grow without bound."""
    names = {name: value for name, value in vars(math).items() if not name.startswith("_")}
    return {
        name: Function(name, value) if callable(value) else value
        for name, value in names.items()
        if name not in _UNBOUNDED
    }


def evaluate(expression: str, names: Mapping[str, Any]) -> Any:
    """Return the value of `expression`, whose names are looked up in `names`.

    Raises RefusedError for an expression that is not arithmetic or too large, NameError for an unknown name,
    and what the operators themselves raise (ZeroDivisionError, TypeError, ...).
    """
    if len(expression) > MAX_TEXT:
        raise RefusedError(f"the expression is longer than {MAX_TEXT} characters")
    return _Evaluation(names).value(ast.parse(expression.strip(), mode="eval").body)


class _Evaluation:
    """One expression's nodes, each by the method of its type's name."""

    def __init__(self, names: Mapping[str, Any]) -> None:
        self._names = names

    def value(self, node: ast.expr) -> Any:
        """The node's value, of a permitted type and size."""
        return _bounded(self._any(node))

    def _any(self, node: ast.expr) -> Any:
        """A value, or a Function in the place of a call's name."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise RefusedError(
                f"'{ast.unparse(node):.80}' is more than arithmetic, which is all that is evaluated"
            )
        return method(node)

    def _constant(self, node: ast.Constant) -> Any:
        return node.value

    def _name(self, node: ast.Name) -> Any:
        return self._look_up(self._names, node.id)

    def _attribute(self, node: ast.Attribute) -> Any:
        """`a.b` is the key b of a namespace or of a dictionary from YAML, or a method of a text or dictionary."""
        owner = self._any(node.value)
        methods = TEXT_METHODS if isinstance(owner, str) else DICT_METHODS if _is_plain(owner) else {}
        if node.attr in methods:
            return Function(node.attr, partial(methods[node.attr], owner))
        if not isinstance(owner, dict) or type(owner) is dict:
            raise RefusedError(
                f"'{ast.unparse(node):.80}' asks for an attribute; only keys of YAML files have dots"
            )
        return self._look_up(owner, node.attr)

    def _look_up(self, names: Mapping[str, Any], name: str) -> Any:
        try:
            return names[name]
        except (KeyError, AttributeError):
            raise NameError(f"name '{name}' is not defined") from None

    def _binop(self, node: ast.BinOp) -> Any:
        apply = _BINARY.get(type(node.op))
        left, right = self.value(node.left), self.value(node.right)
        if apply is None:
            raise RefusedError(f"'{ast.unparse(node):.80}' has an operator that is not arithmetic")
        _check_growth(node.op, left, right)
        if isinstance(node.op, ast.Mod) and isinstance(left, str):
            return filled(left, right)
        return apply(left, right)

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        apply = _UNARY.get(type(node.op))
        if apply is None:
            raise RefusedError(f"'{ast.unparse(node):.80}' has an operator that is not arithmetic")
        return apply(self.value(node.operand))

    def _boolop(self, node: ast.BoolOp) -> Any:
        """Short-circuit evaluation as in Python."""
        for operand in node.values[:-1]:
            value = self.value(operand)
            if bool(value) == isinstance(node.op, ast.Or):
                return value
        return self.value(node.values[-1])

    def _compare(self, node: ast.Compare) -> bool:
        left = self.value(node.left)
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self.value(right_node)
            if not _COMPARE[type(op)](left, right):
                return False
            left = right
        return True

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _joinedstr(self, node: ast.JoinedStr) -> str:
        return "".join(str(self.value(part)) for part in node.values)

    def _formattedvalue(self, node: ast.FormattedValue) -> str:
        value = self.value(node.value)
        value = (
            repr(value)
            if node.conversion == ord("r")
            else str(value)
            if node.conversion == ord("s")
            else value
        )
        return formatted(value, "" if node.format_spec is None else str(self.value(node.format_spec)))

    def _list(self, node: ast.List) -> list[Any]:
        return [self.value(item) for item in node.elts]

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.value(item) for item in node.elts)

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        if None in node.keys:
            raise RefusedError(f"'{ast.unparse(node):.80}' unpacks a dictionary; write its keys")
        return {
            self.value(key): self.value(item)
            for key, item in zip(node.keys, node.values, strict=True)
            if key is not None
        }

    def _subscript(self, node: ast.Subscript) -> Any:
        return self.value(node.value)[self._index(node.slice)]

    def _index(self, node: ast.expr) -> Any:
        if not isinstance(node, ast.Slice):
            return self.value(node)
        ends = (node.lower, node.upper, node.step)
        return slice(*(None if end is None else self.value(end) for end in ends))

    def _call(self, node: ast.Call) -> Any:
        function = self._any(node.func)
        if not isinstance(function, Function):
            raise RefusedError(f"'{ast.unparse(node.func):.80}' is not a permitted function")
        given = [self.value(argument) for argument in node.args]
        named = {keyword.arg: self.value(keyword.value) for keyword in node.keywords if keyword.arg}
        if len(named) != len(node.keywords):
            raise RefusedError(f"'{ast.unparse(node):.80}' unpacks a dictionary; write its keys")
        return function.call(*given, **named)


def _is_plain(value: Any) -> bool:
    """Return whether a value is a dictionary without functions, thus none of the namespaces."""
    return isinstance(value, dict) and not any(isinstance(item, Function) for item in value.values())


def _bounded(value: Any) -> Any:
    """`value` itself; RefusedError for a type that no expression needs, and for what has grown too large."""
    if not isinstance(value, _VALUES) or isinstance(value, Function):
        raise RefusedError(
            f"a value of type {type(value).__name__} is neither number, text, list nor dictionary"
        )
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise RefusedError(f"an integer has more than {MAX_BITS} bits")
    if isinstance(value, str) and len(value) > MAX_STRING:
        raise RefusedError(f"a text is longer than {MAX_STRING} characters")
    if isinstance(value, range) and abs(value.stop - value.start) > MAX_ITEMS * abs(value.step):
        raise RefusedError(f"a range is longer than {MAX_ITEMS} items")
    if isinstance(value, (list, tuple, dict)) and len(value) > MAX_ITEMS:
        raise RefusedError(f"a list is longer than {MAX_ITEMS} items")
    if isinstance(value, dict) and not _is_plain(value):
        raise RefusedError("a namespace of functions is not a value")
    return value


def _check_growth(op: ast.operator, left: Any, right: Any) -> None:
    """RefusedError, before it is computed, for a power or a repetition that would not end."""
    if isinstance(op, ast.Pow) and isinstance(left, int) and isinstance(right, int):
        _check_power(left, right)
    if isinstance(op, ast.Mult):
        for sequence, times in ((left, right), (right, left)):
            if isinstance(sequence, (str, list, tuple)) and isinstance(times, int):
                _check_repetition(sequence, times)


def _check_power(base: int, exponent: int) -> None:
    if exponent > 0 and base.bit_length() * exponent > 2 * MAX_BITS:
        raise RefusedError(f"{base} ** {exponent} has more than {MAX_BITS} bits")


def _check_repetition(sequence: str | list[Any] | tuple[Any, ...], times: int) -> None:
    maximum = MAX_STRING if isinstance(sequence, str) else MAX_ITEMS
    if len(sequence) * times > maximum:
        raise RefusedError(f"a repetition {times} times is longer than {maximum} characters or items")

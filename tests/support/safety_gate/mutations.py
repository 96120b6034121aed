"""Mutants of a module: copies of its syntax tree with one small change each.

The operators are the usual ones of mutation testing (DeMillo, Lipton & Sayward 1978; Offutt et al. 1996): relational,
arithmetic and logical operators, constants, conditions, returned values, removed statements; and for geometry
exchanged minima and maxima, sines and cosines. Texts, annotations, docstrings and the arguments of `njit` are left
as they are.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from typing import NamedTuple

RELATIONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
"""Each relation with its other boundary and its opposite."""
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin"}
NAMES |= {"any": "all", "all": "any", "ceil": "floor", "floor": "ceil", "argmin": "argmax"}
"""Functions that are exchanged for a similar one."""
PASSED_ON = {"abs", "round", "wrap"}
"""Functions of one argument, which is taken instead of their value."""
BOUNDS = {"ge", "gt", "le", "lt", "min_length", "max_length"}
"""Arguments of `Meta` in the annotation of a parameter that bound it."""
DECORATORS_LEFT = {"njit"}
SMALL = 10
"""Whole numbers up to it are changed by one, larger numbers are doubled."""


class Mutant(NamedTuple):
    """One change of a module. function: qualified name, or an empty string outside of functions."""

    module: str
    line: int
    function: str
    before: str
    after: str
    tree: ast.Module
    """The module with the change; to be compiled at once, as the next mutant is made from the same tree."""
    in_body: bool
    """Whether only the body of a function differs, not what is run when the module is imported."""
    lines: range
    """The lines of the changed statement; of a compound one, of its first line."""

    @property
    def change(self) -> str:
        """The change in one line, without its place: `v > 0.0 -> v >= 0.0`."""
        return f"{self.before} -> {self.after}"


class _Place(NamedTuple):
    """Where a node stands: setter in its parent, its statement, its outermost function, and whether in its body."""

    replace: Callable[[ast.AST], None]
    statement: ast.stmt
    function: str
    in_body: bool


def mutants_of(source: str, module: str) -> Iterator[Mutant]:
    """Yield the mutants of a module; each is undone when the next one is taken."""
    tree = ast.parse(source)
    for node, place in list(_below(tree, None, "", False)):
        for other in list(_others(node)):
            before = _head(place.statement)
            ast.copy_location(other, node)
            ast.fix_missing_locations(other)
            place.replace(other)
            after = "(removed)" if node is place.statement and isinstance(other, ast.Pass) else _head(
                other if node is place.statement and isinstance(other, ast.stmt) else place.statement
            )  # fmt: skip
            line = getattr(node, "lineno", place.statement.lineno)
            yield Mutant(
                module, line, place.function, before, after, tree, place.in_body, _lines(place.statement)
            )
            place.replace(node)


def _head(statement: ast.stmt) -> str:
    """Return a statement in one line, of a compound one its first line."""
    text = ast.unparse(statement)
    compound = isinstance(
        statement,
        (ast.If, ast.For, ast.While, ast.With, ast.Try, ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef),
    )
    return text.splitlines()[0] if compound else " ".join(text.split())


def _lines(statement: ast.stmt) -> range:
    body = getattr(statement, "body", [])
    last = body[0].lineno - 1 if body else statement.end_lineno or statement.lineno
    return range(statement.lineno, max(last, statement.lineno) + 1)


def _below(
    parent: ast.AST, statement: ast.stmt | None, function: str, in_body: bool
) -> Iterator[tuple[ast.AST, _Place]]:
    """Yield all nodes below a node that may be changed, each with its place."""
    if isinstance(parent, ast.AnnAssign):
        yield from _bounds(parent, function, in_body)
    for name, value in ast.iter_fields(parent):
        if _is_left(parent, name):
            continue
        inside = in_body or (isinstance(parent, (ast.FunctionDef, ast.AsyncFunctionDef)) and name == "body")
        children = value if isinstance(value, list) else [value]
        for index, child in enumerate(children):
            if not isinstance(child, ast.AST) or _is_docstring(child) or _is_left_decorator(child, name):
                continue
            setter = _item_setter(value, index) if isinstance(value, list) else _field_setter(parent, name)
            own = child if isinstance(child, ast.stmt) else statement
            assert own is not None
            if not isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                yield child, _Place(setter, own, function, inside)
            scope = function
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not inside:
                scope = f"{function}.{child.name}" if function else child.name
            yield from _below(child, own, scope, inside)


def _is_left(parent: ast.AST, field: str) -> bool:
    if field in ("annotation", "returns", "bases"):
        return True
    if field == "keywords" and isinstance(parent, ast.ClassDef):
        return True
    return isinstance(parent, (ast.JoinedStr, ast.Import, ast.ImportFrom, ast.Assert))


def _bounds(statement: ast.AnnAssign, function: str, in_body: bool) -> Iterator[tuple[ast.AST, _Place]]:
    """Yield the bounds of a parameter, which stand in its annotation."""
    for call in ast.walk(statement.annotation):
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "Meta":
            for bound in call.keywords:
                if bound.arg in BOUNDS:
                    yield bound.value, _Place(_field_setter(bound, "value"), statement, function, in_body)


def _is_left_decorator(child: ast.AST, field: str) -> bool:
    called = child.func if isinstance(child, ast.Call) else child
    return field == "decorator_list" and isinstance(called, ast.Name) and called.id in DECORATORS_LEFT


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _item_setter(items: list[ast.AST], index: int) -> Callable[[ast.AST], None]:
    def replace(node: ast.AST) -> None:
        items[index] = node

    return replace


def _field_setter(parent: ast.AST, name: str) -> Callable[[ast.AST], None]:
    return lambda node: setattr(parent, name, node)


def _others(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what a node is exchanged for."""
    if isinstance(node, ast.Compare):
        yield from _relations(node)
    elif isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        yield ast.BinOp(node.left, ARITHMETIC[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.And() if isinstance(node.op, ast.Or) else ast.Or(), node.values)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub, ast.Invert)):
        yield node.operand
    elif isinstance(node, ast.Constant):
        yield from _constants(node.value)
    elif isinstance(node, ast.Call):
        yield from _calls(node)
    elif isinstance(node, ast.IfExp):
        yield from (node.body, node.orelse)
    elif isinstance(node, ast.stmt):
        yield from _statements(node)


def _relations(node: ast.Compare) -> Iterator[ast.AST]:
    for index, operator in enumerate(node.ops):
        for other in RELATIONS[type(operator)]:
            yield ast.Compare(
                node.left, [*node.ops[:index], other(), *node.ops[index + 1 :]], node.comparators
            )


def _constants(value: object) -> Iterator[ast.AST]:
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        yield ast.Constant(value + 1 if value <= SMALL else value * 2)
    elif isinstance(value, float):
        yield ast.Constant(value * 2.0 if value else 1.0)


def _calls(node: ast.Call) -> Iterator[ast.AST]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
    if name in NAMES:
        other = NAMES[name]
        called = (
            ast.Attribute(node.func.value, other, ast.Load())
            if isinstance(node.func, ast.Attribute)
            else ast.Name(other, ast.Load())
        )
        yield ast.Call(called, node.args, node.keywords)
    elif name in PASSED_ON and len(node.args) == 1:
        yield node.args[0]


def _statements(node: ast.stmt) -> Iterator[ast.AST]:
    if isinstance(node, ast.Expr) or (
        isinstance(node, ast.Assign) and not isinstance(node.targets[0], (ast.Name, ast.Tuple))
    ):
        yield ast.Pass()
    elif isinstance(node, ast.AugAssign):
        yield ast.Pass()
        if type(node.op) in ARITHMETIC:
            yield ast.AugAssign(node.target, ARITHMETIC[type(node.op)](), node.value)
    elif isinstance(node, ast.Continue):
        yield ast.Break()
    elif isinstance(node, (ast.If, ast.While)) and isinstance(node.test, (ast.Name, ast.Attribute, ast.Call)):
        yield type(node)(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)
    elif isinstance(node, ast.Return) and node.value is not None and ast.unparse(node.value) != "None":
        yield ast.Return(ast.Constant(None))

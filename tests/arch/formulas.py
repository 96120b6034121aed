"""The arithmetic of the source on attributes of the robot, in a normal form in which copies are equal.

An expression becomes a sum of products: local names are replaced by their values, properties of the robot's sections
by their formulas. So `math.pi * robot.wheels.diameter / robot.motor.ticks_per_turn` and `robot.wheel_radius /
motor.ticks_per_radian` are the same formula.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
import types
import typing
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.arch.syntax import parse_text

import chefbot.robot.chassis
import chefbot.robot.drivetrain
import chefbot.robot.sensors
from chefbot.robot.section import RobotSection
from chefbot.robot.spec import Robot

MODULES = (chefbot.robot.chassis, chefbot.robot.drivetrain, chefbot.robot.sensors)
SECTIONS: dict[str, type] = {"Robot": Robot} | {
    name: value
    for module in MODULES
    for name, value in vars(module).items()
    if isinstance(value, type) and issubclass(value, RobotSection) and value is not RobotSection
}
SHARED = {"Mount", "Housing", "Size", "Offset"}
"""Sections that several others contain: their attributes are named with the owner's."""
CONSTANTS = {"pi": math.pi, "tau": math.tau}
COEFFICIENTS = {"DRIVE_EFFICIENCY", "ROLLING_RESISTANCE", "DRIVEN_WEIGHT_FRACTION"}
"""Constants of robot/spec.py that are the robot's in all but name."""
CALLS = {"hypot", "min", "max", "sqrt", "atan2"}
"""Functions whose value of two attributes is a formula as well."""

Term = frozenset[tuple[str, int]]
"""A product: names with their exponents. All names but those of the robot's attributes begin with `?`."""
Sum = dict[Term, float]
"""A sum of products with their coefficients."""
ONE: Term = frozenset()


class Scope(NamedTuple):
    """Names in a function: those that hold a section of the robot, and those with one value."""

    sections: dict[str, type]
    values: dict[str, ast.expr]


class Formula(NamedTuple):
    """A formula in normal form and where it stands."""

    key: str
    function: str
    line: int
    text: str


def formulas(text: str, path: str) -> Iterator[Formula]:
    """Yield all products and sums of two or more attributes of the robot in a file's text."""
    tree = parse_text(text)
    for owner, function in functions(tree):
        scope = scope_of(function, owner)
        for node in expressions(function):
            for key in keys(expand(node, scope)) if isinstance(node, ast.BinOp) else call_keys(node, scope):
                name = f"{path}:{owner + '.' if owner else ''}{function.name}"
                yield Formula(key, name, node.lineno, ast.unparse(node))


def functions(tree: ast.Module | ast.ClassDef) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield every function with the name of its class."""
    for child in tree.body:
        if isinstance(child, ast.FunctionDef):
            yield getattr(tree, "name", ""), child
        elif isinstance(child, ast.ClassDef):
            yield from functions(child)


def expressions(function: ast.FunctionDef) -> Iterator[ast.BinOp | ast.Call]:
    """Yield the calls of a function, and its arithmetic expressions that are not parts of another."""

    def below(node: ast.AST, inside: bool) -> Iterator[ast.BinOp | ast.Call]:
        for child in ast.iter_child_nodes(node):
            arithmetic = isinstance(child, ast.BinOp | ast.UnaryOp | ast.operator)
            if isinstance(child, ast.Call) or (isinstance(child, ast.BinOp) and not inside):
                yield child
            yield from below(child, arithmetic and (inside or isinstance(child, ast.BinOp)))

    return below(function, False)


def scope_of(function: ast.FunctionDef, owner: str) -> Scope:
    """Return what annotations and single assignments tell of a function's names."""
    sections: dict[str, type] = {"self": SECTIONS[owner]} if owner in SECTIONS else {}
    for argument in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs):
        annotation = ast.unparse(argument.annotation) if argument.annotation else ""
        if annotation in SECTIONS:
            sections[argument.arg] = SECTIONS[annotation]
        elif argument.arg == "robot":
            sections["robot"] = Robot
    found: dict[str, list[ast.expr | None]] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            for name, value in assigned(node.targets[0], node.value):
                found.setdefault(name, []).append(value)
        elif isinstance(node, ast.AugAssign | ast.For | ast.comprehension):
            for name, _ in assigned(node.target, node.target):
                found.setdefault(name, []).append(None)
    single = {name: values[0] for name, values in found.items() if len(values) == 1}
    return Scope(sections, {name: value for name, value in single.items() if value is not None})


def assigned(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr | None]]:
    if isinstance(target, ast.Name):
        yield target.id, value
    elif isinstance(target, ast.Tuple):
        values = value.elts if isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts) else None
        for i, one in enumerate(target.elts):
            for name, inner in assigned(one, values[i] if values else one):
                yield name, inner if values else None


def section_of(node: ast.expr, scope: Scope) -> tuple[type, str] | None:
    """Return the section that an expression is, and its name; None for anything else."""
    if isinstance(node, ast.Name):
        if node.id in scope.sections:
            kind = scope.sections[node.id]
            return kind, kind.__name__
        value = scope.values.get(node.id)
        inner = Scope(scope.sections, {name: one for name, one in scope.values.items() if name != node.id})
        return section_of(value, inner) if value is not None else None
    if not isinstance(node, ast.Attribute):
        return None
    if node.attr in ("robot", "_robot"):
        return Robot, "Robot"
    owner = section_of(node.value, scope)
    kind = fields(owner[0]).get(node.attr) if owner is not None else None
    if owner is None or kind is None:
        return None
    return kind, f"{owner[1]}.{node.attr}" if kind.__name__ in SHARED else kind.__name__


@cache
def fields(kind: type) -> dict[str, type]:
    """Return the fields of a section that are sections themselves."""
    found: dict[str, type] = {}
    for name, hint in typing.get_type_hints(kind).items():
        for one in typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,):
            if isinstance(one, type) and issubclass(one, RobotSection):
                found[name] = one
    return found


def attribute(node: ast.expr, scope: Scope) -> str | None:
    """Return the name of an attribute of the robot, or of a function of the robot or a section alone."""
    if isinstance(node, ast.Name) and node.id in COEFFICIENTS:
        return node.id
    if isinstance(node, ast.Attribute) and (owner := section_of(node.value, scope)) is not None:
        return None if node.attr in fields(owner[0]) else f"{owner[1]}.{node.attr}"
    if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
        owner = section_of(node.args[0], scope)
        if owner is not None and isinstance(node.func, ast.Name | ast.Attribute):
            name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            return f"{owner[1]}.{name}()"
    return None


@cache
def formula_of(name: str) -> Term:
    """Return the product that a property of a section is, or the name itself."""
    section, _, attr = name.partition(".")
    value = inspect.getattr_static(SECTIONS.get(section), attr, None)
    itself = frozenset({(name, 1)})
    if not isinstance(value, property):
        return itself
    (function,) = ast.parse(textwrap.dedent(inspect.getsource(value.fget))).body  # type: ignore[arg-type]
    assert isinstance(function, ast.FunctionDef)
    last = function.body[-1]
    if len(function.body) != 2 or not isinstance(last, ast.Return) or last.value is None:
        return itself
    terms = list(expand(last.value, Scope({"self": SECTIONS[section]}, {})))
    own = [one for one, _ in terms[0] if not one.startswith("?")]
    return full(terms[0]) if len(terms) == 1 and own else itself


def full(term: Term) -> Term:
    """Return a product with the properties of sections replaced by their formulas."""
    total: Sum = {ONE: 1.0}
    for name, exponent in term:
        formula = {frozenset({(name, 1)}): 1.0} if name.startswith("?") else {formula_of(name): 1.0}
        total = times(total, power(formula, exponent))
    return next(iter(total))


def attributes(term: Term) -> list[tuple[str, int]]:
    """Return the attributes of the robot in a product, sorted."""
    return sorted((name, exponent) for name, exponent in term if not name.startswith("?"))


def expand(node: ast.expr, scope: Scope) -> Sum:
    """Return an expression as a sum of products."""
    if isinstance(node, ast.BinOp):
        return operate(node, scope)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return {term: -factor for term, factor in expand(node.operand, scope).items()}
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return {ONE: float(node.value)}
    if isinstance(node, ast.Attribute) and node.attr in CONSTANTS:
        return {ONE: CONSTANTS[node.attr]}
    if (name := attribute(node, scope)) is not None:
        return {frozenset({(name, 1)}): 1.0}
    if isinstance(node, ast.Name) and node.id in scope.values:
        left = {name: one for name, one in scope.values.items() if name != node.id}
        return expand(scope.values[node.id], Scope(scope.sections, left))
    return {frozenset({(f"?{ast.unparse(node)}", 1)}): 1.0}


def operate(node: ast.BinOp, scope: Scope) -> Sum:
    left, right = expand(node.left, scope), expand(node.right, scope)
    if isinstance(node.op, ast.Add | ast.Sub):
        sign = 1.0 if isinstance(node.op, ast.Add) else -1.0
        total = dict(left)
        for term, factor in right.items():
            total[term] = total.get(term, 0.0) + sign * factor
        return {term: factor for term, factor in total.items() if factor}
    if isinstance(node.op, ast.Mult):
        return times(left, right)
    exponent = right.get(ONE) if set(right) == {ONE} else None
    if isinstance(node.op, ast.Div) and len(right) == 1:
        return times(left, power(right, -1))
    if isinstance(node.op, ast.Pow) and exponent in (2.0, 3.0) and len(left) == 1:
        return power(left, int(exponent))
    return {frozenset({(f"?{ast.unparse(node)}", 1)}): 1.0}


def times(left: Sum, right: Sum) -> Sum:
    total: Sum = {}
    for a, x in left.items():
        for b, y in right.items():
            exponents = dict(a)
            for name, exponent in b:
                exponents[name] = exponents.get(name, 0) + exponent
            term = frozenset((name, exponent) for name, exponent in exponents.items() if exponent)
            total[term] = total.get(term, 0.0) + x * y
    return total


def power(value: Sum, exponent: int) -> Sum:
    ((term, factor),) = value.items()
    if not factor:
        return value
    return {frozenset((name, one * exponent) for name, one in term): factor**exponent}


def keys(total: Sum) -> Iterator[str]:
    """Yield the products of two attributes and more, without numbers and other names, and the sum of them.

    A product that stands alone is the same formula as its inverse: metres per tick and ticks per metre.
    """
    for term in total:
        own = attributes(full(term))
        if len(attributes(term)) >= 2 and own:
            sign = -1 if len(total) == 1 and own[0][1] < 0 else 1
            yield " ".join(f"{name}^{sign * exponent}" for name, exponent in own)
    alone = {
        full(term): factor for term, factor in total.items() if term and len(attributes(term)) == len(term)
    }
    if len(alone) >= 2:
        ordered = sorted(alone.items(), key=lambda item: sorted(item[0]))
        yield " + ".join(f"{factor / ordered[0][1]:.6g} {attributes(term)}" for term, factor in ordered)


def call_keys(node: ast.Call, scope: Scope) -> Iterator[str]:
    """Yield a call of a known function on attributes of the robot and numbers only, two attributes at least."""
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name not in CALLS or attribute(node, scope) or any(isinstance(one, ast.Starred) for one in node.args):
        return
    sums = [expand(one, scope) for one in node.args]
    names = {one for total in sums for term in total for one, _ in term}
    if len(names) >= 2 and not any(one.startswith("?") for one in names):
        parts = [
            " + ".join(sorted(f"{x:.6g} {attributes(full(term))}" for term, x in one.items())) for one in sums
        ]
        yield f"{name}({', '.join(sorted(parts))})"


def copies(found: Iterable[Formula]) -> list[Formula]:
    """Return the formulas that stand in more than one function."""
    same: dict[str, list[Formula]] = {}
    for formula in found:
        same.setdefault(formula.key, []).append(formula)
    return [one for all_ in same.values() if len({one.function for one in all_}) > 1 for one in all_]


def read(folder: Path) -> list[tuple[str, str]]:
    """Return path and text of all Python files in a folder."""
    return [(str(path.relative_to(folder)), path.read_text()) for path in sorted(folder.rglob("*.py"))]

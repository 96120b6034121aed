"""xacro's arithmetic: what it gives, and that nothing of a stranger's Python is run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.design.export.xacro_expression import RefusedError, builtin_functions, evaluate, math_names

ORIGIN = {"xyz": [1.0, 2.0], "name": "camera"}
NAMES: dict[str, Any] = {
    **math_names(),
    **builtin_functions(),
    "r": 0.045,
    "side": -1,
    "wheel": "left",
    "o": ORIGIN,
}
FAIR = [
    "1 + 2 * 3 - 4 / 8", "7 // 2", "-7 % 3", "2 ** 10", "2 ** -1", "1e-3", "-pi / 2", "radians(90)",
    "sin(pi / 6) ** 2",
    "r * r * 0.5", "wheel + '_link'", "'wheel_' + str(side)", "1 if wheel == 'left' else -1",
    "not (r > 1) and side < 0", "wheel in ['left', 'right']", "0 < r <= 1", "o['xyz'][0]", "o['xyz'][-1:]",
    "[1, 2, 3][1]", "(1, 2)", "{'a': 1}['a']", "len([1, 2])", "max(r, 2)", "round(pi, ndigits=2)", "sorted([3, 1])",
    "list(range(3))", "'-' * 3", "0 or 'x'", "1 and ''", "None is None", "float('0.5')", "int(3.7)", "sum([1, 2])",
    "dict(a=1)['a']", "list(zip([1], [2]))", "abs(-3)", "hypot(3, 4)", "atan2(1, -1)", "bool(0)", "wheel[0]",
    "wheel.upper()", "wheel.replace('l', 'r')", "'0 0 1'.split()[2]", "'a_b'.split('_')[-1]", "' a '.strip()",
    "'_'.join(['a', 'b'])", "wheel.startswith('le')", "'%.3f' % r", "'%s_%02d' % (wheel, 3)",
    "'%(name)s' % o", "'100%%' % ()",
    "'{} {}'.format(r, side)", "'{:.2f}'.format(r)", "'{a:>5}'.format(a=wheel)", "f'{wheel}_{side:+d}'", "f'{r:.4f}'",
    "f'{wheel!r}'", "sorted(o.keys())", "o.get('none', 3)", "list(o.items())[1]", "round(1234, -2)", "'7'.zfill(3)",
]  # fmt: skip
"""Of real descriptions: whatever Python makes of them."""
ATTACKS = [
    "[c for c in ().__class__.__base__.__subclasses__()]",
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0]('touch {}', shell=True)",
    "(lambda: ().__class__.__base__.__subclasses__())()",
    "().__class__", "''.__class__.__mro__", "r.real", "o.pop('name')", "o.keys", "wheel.upper", "wheel.encode()",
    "[].append(1)", "'{{0.__class__}}'.format(1)", "'{{0[0]}}'.format([1])", "'{{a.__class__}}'.format(a=1)",
    "'{{0!a}}'.format(1)", "'{{:{{}}}}'.format(1, 9)", "'{{:999999999d}}'.format(1)",
    "'{{0:.999999999f}}'.format(1.0)",
    "f'{{r.__class__}}'", "f'{{r:>999999999}}'", "f'{{r:{{10**9}}}}'", "f'{{[c for c in o]}}'", "'%100000000d' % 1",
    "'%*d' % (999999999, 1)", "'%.*f' % (999999999, 1.0)", "'%s%s' * 99 % 1", "'a'.zfill(10 ** 9)",
    "'a'.ljust(10 ** 9)",
    "('a' * 9999).replace('a', 'b' * 9999)", "('a' * 9999).join(['b'] * 9999)", "'a'.format_map(o)",
    "'a'.translate(o)",
    "'%(a)s' % r", "round(1, -10 ** 9)", "prod([9 ** 99] * 9999)", "range(10 ** 400)",
    "str.format('{{0.__class__}}', 1)",
    "(x := 5)", "[*range(3)]",
    "{{**o}}", "dict(**o)", "max(*[1, 2])", "{{c for c in [1]}}", "{{c: c for c in [1]}}", "sum(c for c in [1])",
    "__import__('os').system('touch {}')", "open('{}', 'w')", "eval('1')", "exec('1')", "getattr(1, 'real')",
    "globals()", "type(1)", "vars()", "str.join", "sin", "max(len, len)", "sorted([1], key=len)", "b'1'", "1j", "...",
    "await x", "yield 1", "1 if 0 else (yield)", "1 << 1000000", "~1", "1 | 2", "a @ b", "len.__self__",
    "len[0]", "len.call",
    "(1)(2)", "'open'('{}')", "[open][0]('{}')", "str(sin)", "nothing",
    "10 ** 10 ** 10", "2 ** 100000", "(2 ** 1000) ** 1000", "9 ** 999 * 9 ** 999", "'a' * 10 ** 9", "10 ** 9 * [0]",
    "[[0] * 9999] * 99999", "list(range(10 ** 9))", "range(10 ** 6)", "sum(range(10 ** 12))", "factorial(10 ** 6)",
    "comb(10 ** 6, 10 ** 5)", "('a' * 99999) + ('a' * 99999)", "(-8) ** 0.5", "1; 2", "x = 1", "import os", "",
    "1 " * 6000, "(" * 5000 + ")" * 5000, "-" * 9000 + "1", "int('9' * 4000)",
]  # fmt: skip
"""`{}` is a file that must not appear; braces are doubled."""


@pytest.mark.parametrize("expression", FAIR)
def test_expressions_give_the_results_of_python(expression: str) -> None:
    plain = {name: value for name, value in NAMES.items() if not hasattr(value, "call")}
    assert evaluate(expression, NAMES) == eval(expression, dict(vars(math)), plain)


@pytest.mark.parametrize("expression", ATTACKS, ids=range(len(ATTACKS)))
def test_other_syntax_is_refused_and_nothing_is_executed(expression: str, tmp_path: Path) -> None:
    sentinel = tmp_path / "sentinel"
    text = expression if "{" not in expression else expression.format(sentinel)
    with pytest.raises((RefusedError, NameError, SyntaxError, TypeError, MemoryError, RecursionError)):
        evaluate(text, NAMES)
    assert not sentinel.exists()


def test_the_error_names_the_part_of_the_expression() -> None:
    with pytest.raises(RefusedError, match=r"'\[c for c in o\]' is more than arithmetic"):
        evaluate("1 + len([c for c in o])", NAMES)


def test_only_keys_of_yaml_files_allow_dots() -> None:
    class FromYaml(dict[str, Any]):
        """As xacro wraps it: a dictionary whose keys are reached by dots too."""

    assert evaluate("o.name", {"o": FromYaml(name="camera")}) == "camera"
    with pytest.raises(NameError, match="'pop'"):
        evaluate("o.pop", {"o": FromYaml(name="camera")})


numbers = st.one_of(st.integers(-9, 9).map(str), st.floats(0, 9).map(repr))
operators = st.sampled_from(["+", "-", "*", "/", "//", "%", "**", "<", "==", ">=", "and", "or"])
expressions = st.recursive(
    numbers,
    lambda inner: st.one_of(
        st.tuples(inner, operators, inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(inner, inner, inner).map(lambda t: f"({t[0]} if {t[1]} else {t[2]})"),
        inner.map(lambda a: f"[{a}, 1][-1]"),
        inner.map(lambda a: f"max({a}, 2)"),
    ),
    max_leaves=6,
)


@given(expression=expressions)
def test_arithmetic_equals_that_of_python(expression: str) -> None:
    try:
        ours = evaluate(expression, NAMES)
    except (ZeroDivisionError, OverflowError, TypeError, RefusedError) as error:
        if not isinstance(error, RefusedError):
            with pytest.raises(type(error)):
                eval(expression)
        return
    theirs = eval(expression)
    assert ours == theirs or (math.isnan(ours) and math.isnan(theirs))

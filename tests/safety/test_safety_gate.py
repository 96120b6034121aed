"""The gate of safety: what counts as a mutant, that weak tests are found out, and a part of it with each commit."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.support.safety_gate.judge import Verdict, _exchange
from tests.support.safety_gate.modules import MODULES, REPOSITORY, path_of
from tests.support.safety_gate.mutations import mutants_of
from tests.support.safety_gate.table import counted, equivalents, share_killed, survivors

SMALL = (
    "chefbot.safety.emergency_stop",
    "chefbot.safety.stop_latch",
    "chefbot.safety.command_multiplexer",
    "chefbot.safety.cliff_stop",
    "chefbot.safety.ranger_freshness",
    "chefbot.safety.latency",
    "chefbot.safety.velocity_limiter",
    "chefbot.safety.motion_policy",
    "chefbot.safety.monitor_polygons",
    "chefbot.safety.sensor_freshness",
    "chefbot.safety.obstacle_sensors",
    "chefbot.nodes.emergency_stop",
    "chefbot.nodes.drive_base",
)
"""Modules whose mutants are judged in less than a minute."""
NOT_OF_THE_GATE = {"chefbot.safety"}


def changes(source: str) -> set[str]:
    return {mutant.change for mutant in mutants_of(source, "example")}


@pytest.mark.parametrize(("source", "expected"), [
    ("def f(a):\n    return a < 1", {"return a <= 1", "return a >= 1", "return a < 2", "return None"}),
    ("def f(a):\n    a.stop()", {"(removed)"}),
    ("def f(a):\n    a.v = -a.w", {"(removed)", "a.v = a.w"}),
    ("def f(a, b):\n    return max(a, 2.0)", {"return min(a, 2.0)", "return max(a, 4.0)", "return None"}),
    ("LIMIT = 300", {"LIMIT = 600"}),
    ("def f(a):\n    if a and not b:\n        pass", {"if a or not b:", "if a and b:"}),
    ("class P:\n    t: Annotated[float, Meta(ge=0.5, description='1')]", {
        "t: Annotated[float, Meta(ge=1.0, description='1')]",
    }),
    ("@njit(cache=True)\ndef f(a: 'int | None') -> 'x':\n    '''Text.'''\n    raise ValueError(f'{a + 1}')", set()),
])  # fmt: skip
def test_each_small_change_is_a_mutant(source: str, expected: set[str]) -> None:
    assert {change.partition(" -> ")[2] for change in changes(source)} == expected


def test_a_mutant_belongs_to_the_outermost_function() -> None:
    """Its code is what is exchanged; that of a function inside of it is created whenever it runs."""
    source = "class A:\n    def f(self):\n        def g(x):\n            return x < 1\n        return g"
    assert {mutant.function for mutant in mutants_of(source, "example")} == {"A.f"}


def test_a_method_may_lose_its_call_of_the_base_class(tmp_path: Path) -> None:
    """A mutant without `super` refers to no class any more, which its function has in its closure."""
    source = "class A:\n    def f(self):\n        super().__init__()\n        self.x = 1"
    namespace: dict[str, Any] = {}
    exec(compile(source, str(tmp_path / "a.py"), "exec"), namespace)
    original = namespace["A"].f
    for mutant in mutants_of(source, "example"):
        _exchange(compile(mutant.tree, str(tmp_path / "a.py"), "exec"), mutant.function, [original])
        one = namespace["A"]()
        original(one)
        assert getattr(one, "x", None) == {"self.x = 2": 2, "(removed)": None}.get(
            mutant.change.partition(" -> ")[2] if mutant.line == 4 else "", 1
        )


@pytest.mark.rotated
@pytest.mark.parametrize("module", MODULES)
def test_mutants_are_programs_and_leave_no_trace(module: str) -> None:
    source = path_of(module).read_text()
    original, seen = ast.dump(ast.parse(source)), 0
    for mutant in mutants_of(source, module):
        assert ast.dump(mutant.tree) != original, mutant.change
        compile(mutant.tree, module, "exec")
        tree, seen = mutant.tree, seen + 1
    assert seen and ast.dump(tree) == original


def test_every_module_of_safety_is_in_the_gate_with_its_tests() -> None:
    found = {f"chefbot.safety.{path.stem}" for path in (REPOSITORY / "src/chefbot/safety").glob("*.py")}
    assert {name.removesuffix(".__init__") for name in found} - set(MODULES) == NOT_OF_THE_GATE
    assert not path_of("chefbot.safety.__init__").read_text().partition('"""')[0]
    assert all((REPOSITORY / file).is_file() for files in MODULES.values() for file in files)


@pytest.mark.slow
def test_equivalent_mutants_exist_and_have_a_reason() -> None:
    """Whoever changes the code looks at them again."""
    for one in equivalents():
        known = {mutant.change for mutant in mutants_of(path_of(one["module"]).read_text(), one["module"])}
        assert one["change"] in known and len(one["reason"].split()) > 4 and one["reason"].endswith(".")
    (first, *_) = equivalents()
    assert counted([Verdict(first["module"], 1, "", first["change"], False)]) == []


def test_survivors_are_listed_with_their_place() -> None:
    verdicts = [
        Verdict("chefbot.safety.monitor_polygons", 7, "f", "a < b -> a <= b", False),
        Verdict("m", 1, "", "x -> y", True),
    ]
    assert share_killed(verdicts) == 0.5 and share_killed([]) == 1.0
    assert survivors(verdicts) == "src/chefbot/safety/monitor_polygons.py:7 f\n  - a < b\n  + a <= b\n"


def run_gate(step: str, module: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.support.safety_gate", step, module]
    path = os.pathsep.join([str(REPOSITORY / "src"), str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    return subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
@pytest.mark.rotated("safety gate of a module")
@pytest.mark.parametrize("module", MODULES)
def test_the_tests_of_a_module_reach_all_of_it(module: str) -> None:
    done = run_gate("coverage", module)
    assert done.returncode == 0 and "100 %" in done.stdout, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.rotated("safety gate of a module")
@pytest.mark.parametrize("module", SMALL)
def test_the_tests_of_a_module_kill_its_mutants(module: str) -> None:
    done = run_gate("mutants", module)
    assert done.returncode == 0 and "killed" in done.stdout, done.stdout + done.stderr


def test_the_gate_names_unknown_modules() -> None:
    done = run_gate("coverage", "chefbot.safety.nothing")
    assert done.returncode == 2 and "not of safety: chefbot.safety.nothing" in done.stderr


def test_the_page_shows_all_modules() -> None:
    page = Path(REPOSITORY, "docs", "safety_gate.md").read_text()
    assert all(f"| `{module}` |" in page for module in MODULES)

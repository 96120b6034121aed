"""The rules of the house that a program can check."""

from __future__ import annotations

import ast
import statistics
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.arch.figures import folder_imports, mutual_imports
from tests.arch.syntax import parse, walk

SOURCE = Path(__file__).parents[2] / "src" / "chefbot"
FILES = sorted(SOURCE.rglob("*.py"))
OUTER_RINGS = (
    "cli",
    "proving",
    "launcher",
    "demo",
    "kernels",
    "devices",
    "sim",
    "ui",
    "ros2",
    "bridge",
    "supervision",
    "fleet",
    "signals.py",
    "__main__.py",
)
CLOCK = SOURCE / "runtime" / "clock.py"


def inner_files() -> list[Path]:
    """Rings 0 to 2, where neither the world's clock nor its chance exists."""
    return [path for path in FILES if path.relative_to(SOURCE).parts[0] not in OUTER_RINGS]


def functions() -> Iterator[tuple[str, int]]:
    for path in FILES:
        for node in walk(path):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                lines = (node.end_lineno or node.lineno) - node.lineno + 1
                yield f"{path.relative_to(SOURCE)}:{node.lineno} {node.name}", lines


def called_names(path: Path) -> Iterator[tuple[int, str]]:
    for node in walk(path):
        if isinstance(node, ast.Call) and isinstance(node.func, (ast.Name, ast.Attribute)):
            yield node.lineno, ast.unparse(node.func)


def test_files_stay_readable() -> None:
    long = {
        str(path.relative_to(SOURCE)): n for path in FILES if (n := len(path.read_text().splitlines())) > 400
    }
    assert long == {}


def test_no_folder_is_a_flat_heap() -> None:
    folders = Counter(path.parent for path in FILES if path.name != "__init__.py")
    assert {str(folder): n for folder, n in folders.items() if n > 25} == {}


@pytest.mark.slow
def test_no_two_folders_import_from_each_other() -> None:
    imports = folder_imports()
    assert len(imports) > 50 and mutual_imports(imports) == []
    assert mutual_imports({"a": {"b", "c"}, "b": {"c"}, "c": {"a"}}) == [("a", "c")]


@pytest.mark.slow
def test_names_of_tests_stay_short() -> None:
    long = [
        node.name
        for path in Path(__file__).parents[1].rglob("test_*.py")
        for node in walk(path)
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_") and len(node.name) > 60
    ]
    assert long == []


@pytest.mark.slow
def test_functions_stay_short() -> None:
    lengths = dict(functions())
    assert {name: n for name, n in lengths.items() if n > 60} == {}
    assert statistics.median(lengths.values()) <= 10
    assert sorted(lengths.values())[int(0.95 * len(lengths))] <= 50


PURE = (
    "maths", "msgs", "robot", "odometry", "scan", "slam", "localization", "mapping", "costmap", "planning", "control",
    "behavior", "exploration", "calibration", "safety", "battery", "delivery", "board", "design", "ros2", "config.py",
    "behavior_tree", "causes", "people", "zones", "lidar", "imu", "byte_frames.py", "strict_xml.py", "strict_yaml.py",
)  # fmt: skip
"""Rings 0 and 1, and ros2: what other programs may use as a library."""
UNSPECIFIC = {"UserError", "ChefbotError", "ValueError", "RuntimeError", "Exception"}
"""Exceptions that do not say which case a caller has to handle."""
ALLOWED = ("mapping/compare.py", "buildings/people_spec.py")
"""Where arrays of different shapes are a mistake of the calling program, as in numpy, and where msgspec makes a
ValidationError of the ValueError of a section's `__post_init__`."""


def raised_names(path: Path) -> Iterator[tuple[int, str]]:
    for node in walk(path):
        if isinstance(node, ast.Raise) and node.exc is not None:
            error = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            yield node.lineno, ast.unparse(error)


def test_libraries_raise_their_own_exceptions() -> None:
    files = [path for path in FILES if path.relative_to(SOURCE).parts[0] in PURE]
    assert len(files) > 100
    found = [
        f"{path.relative_to(SOURCE)}:{line} {name}"
        for path in files
        for line, name in raised_names(path)
        if name in UNSPECIFIC and str(path.relative_to(SOURCE)) not in ALLOWED
    ]
    assert found == []


@pytest.mark.slow
def test_every_exception_has_the_common_root() -> None:
    """The command line reports them by that root; node-internal signals are none of its business."""
    roots = {base.__name__ for base in (Exception, ValueError, LookupError, KeyError, RuntimeError)}
    found = [
        f"{path.relative_to(SOURCE)}:{node.lineno} {node.name}"
        for path in FILES
        if path.relative_to(SOURCE).parts[0] in PURE
        for node in walk(path)
        if isinstance(node, ast.ClassDef) and any(ast.unparse(base) in roots for base in node.bases)
    ]
    assert found == []


CLOCK_AND_CHANCE = (
    "time.time",
    "time.sleep",
    "random.",
    "np.random.seed",
    "np.random.rand",
    "np.random.normal",
)


@pytest.mark.slow
def test_algorithms_use_no_clock_no_random_state_and_no_print() -> None:
    found = [
        f"{path.relative_to(SOURCE)}:{line} {name}"
        for path in inner_files()
        for line, name in called_names(path)
        if name == "print" or name.startswith(CLOCK_AND_CHANCE)
    ]
    assert len(inner_files()) > 500 and found == []
    assert [path for path in inner_files() if path != CLOCK and "import time\n" in path.read_text()] == []


@pytest.mark.slow
def test_every_module_has_a_docstring() -> None:
    silent = [str(path.relative_to(SOURCE)) for path in FILES if not ast.get_docstring(parse(path))]
    assert silent == []


@pytest.mark.slow
def test_every_public_class_and_function_has_a_docstring() -> None:
    silent = []
    for path in FILES:
        for node in parse(path).body:
            public = isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_")
            if public and not ast.get_docstring(node):
                silent.append(f"{path.relative_to(SOURCE)}:{node.lineno} {node.name}")
    assert silent == []


def test_no_developer_path_and_no_unfinished_work() -> None:
    words = ("TO" + "DO", "FIX" + "ME", "NotImplemented" + "Error", "/ro" + "ot/", "/wo" + "rk/")
    found = [
        f"{path.relative_to(SOURCE)}: {word}" for path in FILES for word in words if word in path.read_text()
    ]
    assert found == []

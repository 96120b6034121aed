"""Count what the house rules limit: run `python -m tests.arch.figures` for a table."""

from __future__ import annotations

import ast
import io
import re
import statistics
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.arch.dialect import WORDS
from tests.arch.syntax import parse, walk, walk_text

REPOSITORY = Path(__file__).parents[2]
SOURCE = REPOSITORY / "src" / "chefbot"
FILES = sorted(SOURCE.rglob("*.py"))
KERNEL_FOLDERS = ("odometry", "slam", "localization", "control", "planning", "costmap")
"""Folders whose kernels and filters read like the paper's box: with a comment per step."""
MAX_NODE_LINES, MAX_FLAT_FILES, FEWEST_WORDS = 150, 25, 5
FEWEST_COMMENTS = 5.0
"""Comments per 100 code lines that the kernels have at least."""


def parts_of(identifier: str) -> list[str]:
    """'_TellHealth' -> ['tell', 'health']; `at_least_one` and `least_squares` are plain English."""
    words = re.sub("at_(least|most)|least_squares", "", identifier)
    return [part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", words)]


def defined_name(node: ast.AST) -> str:
    """Identifier that a node defines or assigns, empty for none."""
    if isinstance(node, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
        return "" if node.name == "tell" else node.name  # a method of Python's file objects
    if isinstance(node, ast.arg):
        return node.arg
    if isinstance(node, ast.Name):
        return node.id if isinstance(node.ctx, ast.Store) else ""
    if isinstance(node, ast.Attribute):
        return node.attr if isinstance(node.ctx, ast.Store) else ""
    return node.asname or "" if isinstance(node, ast.alias) else ""


def pattern(phrases: Iterable[str]) -> re.Pattern[str]:
    """Pattern of any of the phrases, as whole words."""
    return re.compile(rf"(?<![\w-])(?:{'|'.join(map(re.escape, phrases))})(?![\w-])", re.IGNORECASE)


ANY_PHRASE = pattern(WORDS.prose)
PHRASES = {phrase: pattern([phrase]) for phrase in WORDS.prose}


def phrases_in(text: str) -> list[str]:
    """The words and phrases of the list that stand in a text, each as often as it does."""
    words = " ".join(text.split())
    if not ANY_PHRASE.search(words):
        return []
    return [phrase for phrase, found in PHRASES.items() for _ in found.findall(words)]


def dialect_in(path: Path) -> Counter[str]:
    """How often each word or phrase of the list stands in a file's identifiers and in its text in quotes: docstrings,
    help texts, sentences for people; keys and patterns of one word as well."""
    names: set[str] = set()
    found: Counter[str] = Counter()
    for node in walk(path):
        if isinstance(node, ast.Constant):
            found.update(phrases_in(node.value) if isinstance(node.value, str) else ())
        elif name := defined_name(node):
            names.add(name)
    parts = Counter(part for name in names for part in parts_of(name))
    return found + Counter({word: parts[word] for word in WORDS.identifiers})


def duplicate_classes(classes: dict[str, list[str]]) -> dict[str, list[str]]:
    """The names of more than one class; messages of different ROS packages, a module of msgs/ each, may share one."""

    def is_rule(places: list[str]) -> bool:
        return len(set(places)) == len(places) and all(
            re.fullmatch(r"msgs/\w+\.py", place) for place in places
        )

    return {name: places for name, places in classes.items() if len(places) > 1 and not is_rule(places)}


def names_of_tests() -> Iterator[tuple[Path, str]]:
    """File and name of each test function, those of this folder aside, which name the words of the list."""
    for path in sorted(REPOSITORY.glob("tests/**/test_*.py")):
        if path.parent.name != "arch":
            for node in walk(path):
                if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                    yield path, node.name


def dialect_in_test_names() -> list[str]:
    """Names of tests with words of the list."""
    return [
        f"{path.relative_to(REPOSITORY)} {name}"
        for path, name in names_of_tests()
        if {*WORDS.identifiers, *WORDS.prose} & set(parts_of(name))
    ]


def imported_modules(path: Path) -> Iterator[str]:
    """Modules of the project that a file imports, also inside functions and for types only."""
    for node in walk(path):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("chefbot."):
            yield from (
                f"{node.module}.{alias.name}"
                if is_module(f"{node.module}.{alias.name}")
                else str(node.module)
                for alias in node.names
            )


def is_module(name: str) -> bool:
    path = SOURCE.parent.joinpath(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def folder_imports() -> dict[str, set[str]]:
    """The folders from which the modules of each folder import; a folder and its parents count as one."""
    found: dict[str, set[str]] = {}
    for path in FILES:
        own = ".".join(path.relative_to(SOURCE.parent).parent.parts)
        for name in imported_modules(path):
            folder = name if SOURCE.parent.joinpath(*name.split(".")).is_dir() else name.rpartition(".")[0]
            if not (f"{own}.".startswith(f"{folder}.") or f"{folder}.".startswith(f"{own}.")):
                found.setdefault(own, set()).add(folder)
    return found


def mutual_imports(imports: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Pairs of folders that import from each other."""
    return sorted(
        (one, other)
        for one, others in imports.items()
        for other in others
        if one < other and one in imports.get(other, ())
    )


def class_names() -> dict[str, list[str]]:
    """Each name of a class, also of private and nested ones, and the file of each definition."""
    found: dict[str, list[str]] = {}
    for path in FILES:
        for node in walk(path):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(path.relative_to(SOURCE).as_posix())
    return found


def public_docstrings(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Line with name, and docstring, of each public class, function and method of a module."""
    bodies = [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))]
    for node in (node for body in bodies for node in body):
        public = isinstance(node, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        if public and not node.name.startswith("_") and (text := ast.get_docstring(node)):
            yield f"{node.lineno} {node.name}", text


def is_fragment(docstring: str) -> bool:
    """Whether the first paragraph of a docstring has fewer than FEWEST_WORDS words."""
    return len(docstring.split("\n\n")[0].split()) < FEWEST_WORDS


def fragments() -> list[str]:
    """Places of public docstrings whose first paragraph is not a sentence."""
    return [
        f"{path.relative_to(SOURCE)}:{place}"
        for path in FILES
        for place, text in public_docstrings(parse(path))
        if is_fragment(text)
    ]


NO_CODE = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
)


def comments_per_100_lines(paths: list[Path]) -> float:
    """Comments a hundred lines of code, docstrings and blank lines left out."""
    comments = code = 0
    for path in paths:
        text = path.read_text()
        documented = {
            line
            for node in walk_text(text)
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
        }
        lines: set[int] = set()
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT and not re.match(r"#\s*(noqa|type:|fmt:)", token.string):
                comments += 1
            elif token.type not in NO_CODE:
                lines.add(token.start[0])
        code += len(lines - documented)
    return 100.0 * comments / code


def kernel_files() -> list[Path]:
    """Files with compiled kernels of the algorithms, and the filters."""
    inside = [path for path in FILES if path.relative_to(SOURCE).parts[0] in KERNEL_FOLDERS]
    return [path for path in inside if "@njit" in path.read_text()]


def function_lengths() -> list[int]:
    """Lines of each function with its docstring; lines that are blank or only a comment do not count, as kernels have
    a comment a step.
    """
    return [
        sum(not re.match(r"\s*(#|$)", line) for line in lines[node.lineno - 1 : node.end_lineno])
        for path in FILES
        for lines in [path.read_text().splitlines()]
        for node in walk(path)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
    ]


def flat_folders() -> dict[str, int]:
    """Folders with more than MAX_FLAT_FILES modules."""
    count = Counter(str(path.parent.relative_to(SOURCE)) for path in FILES if path.name != "__init__.py")
    return {folder: number for folder, number in count.items() if number > MAX_FLAT_FILES}


def long_nodes() -> dict[str, int]:
    """Files of nodes, also in the folders below, with more than MAX_NODE_LINES lines."""
    nodes = SOURCE / "nodes"
    lines = {str(path.relative_to(nodes)): len(path.read_text().splitlines()) for path in nodes.rglob("*.py")}
    return {name: count for name, count in sorted(lines.items()) if count > MAX_NODE_LINES}


def modules_without_test() -> list[str]:
    """Modules with logic that no file under tests imports by name."""
    imported = set(
        re.findall(r"chefbot(?:\.\w+)+", "\n".join(p.read_text() for p in REPOSITORY.glob("tests/**/*.py")))
    )
    from_packages = re.compile(r"from (chefbot(?:\.\w+)*) import \(?([^)\n]*)")
    for path in REPOSITORY.glob("tests/**/*.py"):
        for package, names in from_packages.findall(path.read_text()):
            imported |= {f"{package}.{name.strip().split()[0]}" for name in names.split(",") if name.strip()}
    modules = [".".join(path.relative_to(SOURCE.parent).with_suffix("").parts) for path in FILES]
    return [name for name in modules if not name.endswith("__init__") and name not in imported]


def table() -> list[tuple[str, str]]:
    dialect = sum(sum(dialect_in(path).values()) for path in FILES)
    lengths = sorted(function_lengths())
    lines = sum(len(path.read_text().splitlines()) for path in FILES)
    thought = (
        "odometry",
        "scan",
        "slam",
        "localization",
        "mapping",
        "costmap",
        "planning",
        "control",
        "behavior",
    )
    thought += ("exploration", "calibration", "safety", "battery", "delivery", "board", "maths")
    pure = sum(len(p.read_text().splitlines()) for p in FILES if p.relative_to(SOURCE).parts[0] in thought)
    median, p95 = statistics.median(lengths), lengths[int(0.95 * len(lengths))]
    return [
        ("words of the list in identifiers and strings", str(dialect)),
        ("class names used twice", str(len(duplicate_classes(class_names())))),
        ("public docstrings of fewer than five words", str(len(fragments()))),
        ("comments per 100 code lines in kernels", f"{comments_per_100_lines(kernel_files()):.1f}"),
        (f"node files over {MAX_NODE_LINES} lines", str(len(long_nodes()))),
        (f"flat folders over {MAX_FLAT_FILES} files", str(flat_folders())),
        ("Python lines in src; pure algorithms", f"{lines}; {100 * pure / lines:.0f} %"),
        ("modules imported by no test", str(len(modules_without_test()))),
        ("function median, p95, max, without comments", f"{median:g}, {p95}, {lengths[-1]}"),
    ]


if __name__ == "__main__":
    for name, value in table():
        print(f"{name:50}{value}")  # noqa: T201

"""Mutation test of the safety part: changes the source in one small place, and the unit tests must notice.

Usage: mutate.py --build FOLDER --core FOLDER NAME...
FOLDER of --build holds the objects of the unchanged program, and `unit_tests.o`. Prints what survived and
killed/total; fails below the share in WANTED. A mutant that does not compile does not count.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

WANTED = 0.9
TIMEOUT = 20.0  # seconds; a mutant that loops for ever is noticed
WORKERS = 2
FLAGS = ["-std=c++11", "-O0", "-w"]

SWAPS = {
    "<": ("<=", ">"), "<=": ("<",), ">": (">=", "<"), ">=": (">",), "==": ("!=",), "!=": ("==",),
    "&&": ("||",), "||": ("&&",), "+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "++": ("--",), "--": ("++",),
    "+=": ("-=",), "-=": ("+=",), "&=": ("|=",), "|=": ("&=",), "<<": (">>",), ">>": ("<<",),
    "&": ("|",), "|": ("&",), "^": ("|",), "!": ("",), "true": ("false",), "false": ("true",),
}  # fmt: skip
TOKEN = re.compile(
    r"'(?:\\.|[^'])'|\"[^\"]*\"|->|<<=|>>=|<=|>=|==|!=|&&|\|\||\+\+|--|\+=|-=|&=|\|=|\^=|<<|>>"
    r"|0x[0-9A-Fa-f]+u?|\b\d+u?\b|\w+|[-+*/<>&|^!]"
)
TYPES = re.compile(
    r"static_cast<[^>]*>|#include.*|\b\w+ &\w+|(?:[,(]\s*|^\s*|const )[\w:]+ \*+\w+|case \w+:|\benum\b.*"
)
DECLARED = r"(?:u?int\d+_t|bool|char|Pair|Flags) \w+ ="
STATEMENT = re.compile(
    rf"^\s+(?!\s|default|return\b|const\b|static\b|else\b|typedef\b|using\b|{DECLARED})[^{{}}]*;\s*$"
)


class Mutant(NamedTuple):
    """One change of one line."""

    file: str
    line: int
    was: str
    text: str


def code_of(line: str) -> str:
    """The line without its comment."""
    return line.split("//")[0]


def mutants_of_line(line: str) -> Iterator[str]:
    """Every variant of a line of code."""
    code = code_of(line)
    fixed = [m.span() for m in TYPES.finditer(code)]
    for token in TOKEN.finditer(code):
        if any(start <= token.start() < end for start, end in fixed):
            continue
        for new in replacements(token.group()):
            yield code[: token.start()] + new + code[token.end() :]
    if STATEMENT.match(code):
        yield re.sub(r"\S.*", ";", code)


def replacements(token: str) -> tuple[str, ...]:
    """Of one token; numbers get neighbours."""
    if token in SWAPS:
        return SWAPS[token]
    if re.fullmatch(r"(0x[0-9A-Fa-f]+|\d+)u?", token):
        value = int(token.rstrip("u"), 0)
        return (f"{value + 1}u",) if token.endswith("u") else (f"{value + 1}",)
    return ()


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Every variant of a file; of a header only its constants."""
    header = path.suffix == ".h"
    for number, line in enumerate(path.read_text().split("\n"), 1):
        if header and not re.match(r"\s*static const \w+ .*=", line):
            continue
        if line.lstrip().startswith(("#", "//", "namespace")):
            continue
        for text in mutants_of_line(line):
            yield Mutant(path.name, number, line.strip(), text)


class Judge:
    """Builds and runs one mutant after another in a folder of its own."""

    def __init__(self, core: Path, build: Path) -> None:
        self.build = build.resolve()
        self._kept = tempfile.TemporaryDirectory()  # the source may be edited while this runs
        self.core = Path(self._kept.name) / "core"
        shutil.copytree(core, self.core)
        self.names = sorted(p.stem for p in self.core.glob("*.cpp"))

    def verdict(self, mutant: Mutant) -> str:
        """One of "killed", "survived", "no program"."""
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "core"
            shutil.copytree(self.core, source)
            lines = (source / mutant.file).read_text().split("\n")
            lines[mutant.line - 1] = mutant.text
            (source / mutant.file).write_text("\n".join(lines))
            program = self._program(Path(folder), source, mutant.file)
            return "no program" if program is None else self._run(program)

    def _program(self, folder: Path, source: Path, file: str) -> Path | None:
        changed = self.names if file.endswith(".h") else [Path(file).stem]
        for name in changed:
            files = ["-c", str(source / f"{name}.cpp"), "-o", str(folder / f"{name}.o")]
            command = ["g++", *FLAGS, f"-I{source}", *files]
            if subprocess.run(command, capture_output=True).returncode:
                return None
        objects = [str((folder if n in changed else self.build) / f"{n}.o") for n in self.names]
        program = folder / "unit_tests"
        command = ["g++", *objects, str(self.build / "unit_tests.o"), "-o", str(program)]
        return None if subprocess.run(command, capture_output=True).returncode else program

    def _run(self, program: Path) -> str:
        try:
            done = subprocess.run([str(program), "--first"], capture_output=True, timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            return "killed"
        return "killed" if done.returncode else "survived"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--core", type=Path, required=True)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("names", nargs="+")
    options = parser.parse_args()
    files = [
        p for n in options.names for p in (options.core / f"{n}.cpp", options.core / f"{n}.h") if p.exists()
    ]
    mutants = [m for path in files for m in mutants_of(path)]
    judge = Judge(options.core, options.build)
    with ThreadPoolExecutor(WORKERS) as pool:
        verdicts = list(pool.map(judge.verdict, mutants))
    for mutant, verdict in zip(mutants, verdicts, strict=True):
        if verdict == "survived":
            print(f"survived: {mutant.file}:{mutant.line}: {mutant.was}  ->  {mutant.text.strip()}")
    killed, survived = verdicts.count("killed"), verdicts.count("survived")
    share = killed / (killed + survived)
    print(f"mutants of the safety part: {killed}/{killed + survived} killed, {100 * share:.1f} %")
    return 0 if share >= WANTED else 1


if __name__ == "__main__":
    sys.exit(main())

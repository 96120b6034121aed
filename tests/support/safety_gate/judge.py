"""Judges mutants: the tests of a module have to fail for each of them.

All is imported once. A mutant is a forked process that exchanges the code of one function and runs the tests that
reach its line, the fastest first, until one fails; one that changes what is run on import (constants, defaults,
bounds of parameters) imports the project again. A mutant that takes much longer than the original counts as killed.
"""

from __future__ import annotations

import gc
import importlib.machinery
import importlib.util
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from importlib.abc import MetaPathFinder
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import pytest
from hypothesis import Phase, settings

from tests.support.safety_gate.measure import OPTIONS, ContextPerTest, new_coverage
from tests.support.safety_gate.modules import MODULES, path_of, without_compiler
from tests.support.safety_gate.mutations import Mutant, mutants_of

PATIENCE, MIN_PATIENCE = 5.0, 5.0
"""Factor on the time of the tests without a mutant, and the time (s) beside it, after which a mutant is killed."""
HANGS = 12.0
"""Factor on that time of the processor for the time of the wall's clock, of a mutant that waits for nothing."""
MEMORY = 8 << 30
"""Address space that a mutant may use, bytes."""
QUIET = [*OPTIONS, "--tb=no"]
NOT_FOUND, BROKEN = 98, 99
"""Results of a process that could not judge: a function that is not there, and an exception outside of the tests."""
IMPORTED_BY_ALL = (
    "numpy",
    "numba",
    "scipy.ndimage",
    "scipy.spatial",
    "msgspec",
    "hypothesis",
    "mujoco",
    "zenoh",
)


class Verdict(NamedTuple):
    """Whether the tests distinguish a mutant from the original."""

    module: str
    line: int
    function: str
    change: str
    killed: bool


class Baseline(NamedTuple):
    """The tests of a module without a mutant: seconds by name, fastest first, and the names by line."""

    seconds: dict[str, float]
    tests_of_line: dict[int, list[str]]

    def reaching(self, mutant: Mutant, lines: Sequence[int]) -> list[str]:
        """Return the tests that run one of the lines of a mutant's statement; all for one outside of functions."""
        if not mutant.in_body:
            return list(self.seconds)
        chosen = {test for line in lines for test in self.tests_of_line.get(line, [])}
        return [test for test in self.seconds if test in chosen]


def judged(module: str, jobs: int, sample: Callable[[int], bool] = lambda _: True) -> list[Verdict]:
    """Return the verdict on each mutant of a module. sample: whether the mutant of an index is judged."""
    os.environ.update(without_compiler([module]))
    for name in IMPORTED_BY_ALL:
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder, "verdicts.json")
        _wait_for(_fork(lambda: _judge_bodies(module, jobs, sample, found), None))
        answer = json.loads(found.read_text())
    baseline = Baseline(answer["seconds"], {})
    verdicts = [Verdict(*one) for one in answer["verdicts"]]
    pool = _Pool(jobs)
    for index, mutant in enumerate(mutants_of(path_of(module).read_text(), module)):
        if sample(index) and not mutant.in_body:
            limit = PATIENCE * (answer["took"] + sum(baseline.seconds.values())) + MIN_PATIENCE
            pool.start(mutant, lambda mutant=mutant: _run_imported(mutant, list(baseline.seconds)), limit)
    return sorted(verdicts + pool.verdicts(), key=lambda one: one.line)


# -- processes


def _fork(work: Callable[[], int], limit: float | None) -> int:
    """Run work in a forked process, silently for at most `limit` seconds, and return its number.

    limit: of the processor's time, as others may use it as well.
    """
    sys.stdout.flush()
    number = os.fork()
    if number:
        return number
    code = BROKEN
    try:
        if limit is not None:
            for timer, kind, seconds in (
                (signal.ITIMER_PROF, signal.SIGPROF, limit),
                (signal.ITIMER_REAL, signal.SIGALRM, HANGS * limit),
            ):
                signal.signal(kind, signal.SIG_DFL)
                signal.setitimer(timer, seconds)
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            silent = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silent, 1)
            os.dup2(silent, 2)
        code = work()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _wait_for(number: int) -> None:
    _, status = os.waitpid(number, 0)
    if status:
        raise SystemExit("The tests of safety fail without a mutant.")


class _Pool:
    """Mutants that are judged at once, each in a process."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._running: dict[int, tuple[Any, ...]] = {}
        self._verdicts: list[Verdict] = []

    def start(self, mutant: Mutant, work: Callable[[], int], limit: float) -> None:
        """Judge a mutant by the result of `work`, 0 if it survives; waits while others take all places."""
        while len(self._running) >= self._jobs:
            self._take_one()
        self._running[_fork(work, limit)] = (mutant.module, mutant.line, mutant.function, mutant.change)

    def verdicts(self) -> list[Verdict]:
        """Wait for the last ones, and return all verdicts."""
        while self._running:
            self._take_one()
        return self._verdicts

    def _take_one(self) -> None:
        number, status = os.wait()
        verdict = Verdict(*self._running.pop(number), status != 0)
        if os.WIFEXITED(status) and os.WEXITSTATUS(status) in (NOT_FOUND, BROKEN):
            raise SystemExit(f"{verdict.module}:{verdict.line} cannot be judged: {verdict.change}")
        self._verdicts.append(verdict)


# -- mutants of functions: the code is exchanged


def _judge_bodies(module: str, jobs: int, sample: Callable[[int], bool], found: Path) -> int:
    coverage = new_coverage([module])
    coverage.start()
    contexts = ContextPerTest(coverage)
    judge = _BodyJudge(module, jobs, sample, contexts, found)
    return int(pytest.main([*QUIET, *MODULES[module]], plugins=[judge, contexts]))


class _BodyJudge:
    """Plugin of pytest that runs the tests once, and then for each mutant those that reach it."""

    def __init__(
        self, module: str, jobs: int, sample: Callable[[int], bool], contexts: ContextPerTest, found: Path
    ) -> None:
        self._module, self._jobs, self._sample = module, jobs, sample
        self._contexts, self._found = contexts, found
        self._seconds: dict[str, float] = defaultdict(float)
        self._failed = False
        self._began = time.monotonic()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note failures and durations."""
        self._failed = self._failed or report.failed
        self._seconds[report.nodeid] += report.duration

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests, and then those of each mutant."""
        for item in session.items:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        self._contexts.stop()
        if self._failed or not session.items:
            os._exit(1)
        settings.register_profile("judge", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("judge")  # a counterexample need not be small
        took, pool = time.monotonic() - self._began, _Pool(self._jobs)
        baseline = self._baseline()
        items = {item.nodeid: item for item in session.items}
        gc.unfreeze()  # what is frozen is not found
        self._functions = _functions_of(str(path_of(self._module)))
        gc.freeze()  # a forked process that collects garbage would copy all memory
        gc.disable()
        for index, mutant in enumerate(mutants_of(path_of(self._module).read_text(), self._module)):
            if mutant.in_body and self._sample(index):
                self._judge(mutant, baseline, items, pool)
        answer = {"seconds": baseline.seconds, "took": took, "verdicts": pool.verdicts()}
        self._found.write_text(json.dumps(answer))
        return True

    def _baseline(self) -> Baseline:
        data, file = self._contexts.coverage.get_data(), str(path_of(self._module))
        by_line = data.contexts_by_lineno(file)
        return Baseline(dict(sorted(self._seconds.items(), key=lambda pair: pair[1])), by_line)

    def _judge(self, mutant: Mutant, baseline: Baseline, items: dict[str, pytest.Item], pool: _Pool) -> None:
        tests = baseline.reaching(mutant, mutant.lines)
        code = compile(mutant.tree, str(path_of(self._module)), "exec")
        limit = PATIENCE * sum(baseline.seconds[test] for test in tests) + MIN_PATIENCE
        pool.start(mutant, lambda: self._run(code, mutant.function, [items[test] for test in tests]), limit)

    def _run(self, code: CodeType, function: str, tests: list[pytest.Item]) -> int:
        """Exchange the code of a function and run tests until one fails; return 0 if none does."""
        _exchange(code, function, self._functions[function])
        for item in tests:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
            if self._failed:
                return 1
        return 0


def _functions_of(file: str) -> dict[str, list[FunctionType]]:
    """Return the functions of a file by their qualified names."""
    found: dict[str, list[FunctionType]] = defaultdict(list)
    for one in gc.get_objects():
        if isinstance(one, FunctionType) and one.__code__.co_filename == file:
            found[one.__code__.co_qualname].append(one)
    return found


def _exchange(module: CodeType, function: str, found: list[FunctionType]) -> None:
    """Give all functions of a qualified name in a module's file the code that they have in `module`."""
    new = {code.co_firstlineno: code for code in _codes(module) if code.co_qualname == function}
    if not found:
        os._exit(NOT_FOUND)
    for one in found:
        code = new[one.__code__.co_firstlineno]
        # a method that calls `super` no more refers to no class; the function keeps the place for it
        one.__code__ = code.replace(co_freevars=one.__code__.co_freevars)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield one
            yield from _codes(one)


# -- mutants of what is run on import


class _MutantFinder(MetaPathFinder):
    """Finds one module in its mutated form."""

    def __init__(self, module: str, code: CodeType) -> None:
        self._module, self._code = module, code

    def find_spec(self, fullname: str, path: Any, target: ModuleType | None = None) -> Any:
        """Return the module's specification with a loader of the mutant's code, and nothing for other modules."""
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if fullname != self._module or spec is None:
            return None
        spec.loader = _MutantLoader(self._code, fullname, str(spec.origin))
        return spec


class _MutantLoader(importlib.machinery.SourceFileLoader):
    def __init__(self, code: CodeType, fullname: str, path: str) -> None:
        super().__init__(fullname, path)
        self._code = code

    def get_code(self, _: str) -> CodeType:
        return self._code


def _run_imported(mutant: Mutant, tests: list[str]) -> int:
    """Import a mutant and run tests until one fails; return 0 if none does."""
    code = compile(mutant.tree, str(path_of(mutant.module)), "exec")
    sys.meta_path.insert(0, _MutantFinder(mutant.module, code))
    # parameters of tests are left out of their names, as they may be made of what is changed
    functions = dict.fromkeys(test.partition("[")[0] for test in tests)
    return int(pytest.main([*QUIET, "-x", *functions]))

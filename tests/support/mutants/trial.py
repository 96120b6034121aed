"""Mutants read in child processes with limits of memory and CPU time: what each of them does is counted."""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from chefbot.errors import ChefbotError
from tests.support.mutants.samples import Sample, samples, write

MEMORY_MB, CPU_SECONDS = 400, 2.0
"""Limits of a mutant; the memory is what the process grows by."""
HANG_SECONDS = 10.0
"""Time without any word from a child after which it hangs: it waits for something and uses no CPU time."""
MAX_SENTENCE = 700


class Outcome(NamedTuple):
    """What one mutant did: read, sentence, traceback, signal, hang, slow, large, or not a sentence."""

    kind: str
    seed: str
    detail: str = ""
    cpu: float = 0.0
    grown_mb: float = 0.0


@dataclass
class Report:
    """The outcomes of one kind of file."""

    counts: Counter[str] = field(default_factory=Counter)
    faults: list[Outcome] = field(default_factory=list)
    cpu: float = 0.0
    grown_mb: float = 0.0

    def add(self, outcome: Outcome) -> None:
        """Count an outcome; faults are kept."""
        self.counts[outcome.kind] += 1
        self.cpu, self.grown_mb = max(self.cpu, outcome.cpu), max(self.grown_mb, outcome.grown_mb)
        if outcome.kind not in ("read", "sentence"):
            self.faults.append(outcome)


def run(kind: str, seed: int, number: int) -> Report:
    """Read `number` mutants of a kind of file; a child that dies is replaced by another one."""
    report, done = Report(), 0
    while done < number:
        for outcome in _child(kind, seed, done, number):
            report.add(outcome)
            done += 1
    return report


def mutant_rng(kind: str, seed: int, number: int) -> Random:
    """Return the generator of one mutant, which depends on nothing else."""
    return Random(f"{kind} {seed} {number}")


def _child(kind: str, seed: int, first: int, number: int) -> list[Outcome]:
    """The outcomes of mutants from `first` on, up to the death of the child, which is the last outcome."""
    sample = samples()[kind]
    read_end, write_end = os.pipe()
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        os.close(read_end)
        _work(sample, kind, seed, range(first, number), write_end)
    os.close(write_end)
    outcomes, hung = _listen(read_end, pid)
    status = os.waitpid(pid, 0)[1]
    if len(outcomes) < number - first:
        name = f"{kind} {seed} {first + len(outcomes)}"
        end = "hang" if hung else "signal"
        detail = "it waited" if hung else _death(status)
        outcomes.append(Outcome(end, name, detail))
    return outcomes


def _death(status: int) -> str:
    if not os.WIFSIGNALED(status):
        return f"exit code {os.waitstatus_to_exitcode(status)}"
    number = os.WTERMSIG(status)
    return f"more than {CPU_SECONDS:g} s of CPU" if number == signal.SIGPROF else signal.Signals(number).name


def _listen(read_end: int, pid: int) -> tuple[list[Outcome], bool]:
    lines = b""
    hung = False
    with os.fdopen(read_end, "rb", buffering=0) as pipe:
        while True:
            if not select.select([pipe], [], [], HANG_SECONDS)[0]:
                os.kill(pid, signal.SIGKILL)
                hung = True
            data = pipe.read(65536)
            if not data:
                break
            lines += data
    return [Outcome(*json.loads(line)) for line in lines.split(b"\n")[:-1]], hung


def _work(sample: Sample, kind: str, seed: int, numbers: range, out: int) -> None:
    """The child's whole life; one line a mutant goes to `out`."""
    try:
        _quiet()
        _limit()
        with tempfile.TemporaryDirectory(prefix="mutants_") as folder:
            for number in numbers:
                outcome = _try(sample, Path(folder, "m"), kind, seed, number)
                os.write(out, json.dumps(outcome).encode() + b"\n")
    except BaseException:
        os.write(2, traceback.format_exc().encode())
        os._exit(70)
    os._exit(0)


def _quiet() -> None:
    """Send to nowhere what a reader prints, and no stack of a child that a signal ends: that is an outcome."""
    faulthandler.disable()
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    os.dup2(null, 1)


def _limit() -> None:
    """Above MEMORY_MB beyond what the process has now, memory is refused."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    size = now + MEMORY_MB * 1_000_000
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)


def _try(sample: Sample, folder: Path, kind: str, seed: int, number: int) -> Outcome:
    name = f"{kind} {seed} {number}"
    shutil.rmtree(folder, ignore_errors=True)
    files = sample.mutant(mutant_rng(kind, seed, number))
    write(folder, files)
    del files
    before, begun = _reset_peak(), time.process_time()
    signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
    try:
        sample.read(folder)
        end, detail = "read", ""
    except ChefbotError as error:
        end, detail = _judge(str(error))
    except BaseException:
        end, detail = "traceback", traceback.format_exc()[-1500:]
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    cpu, grown = time.process_time() - begun, _peak() - before
    if end in ("read", "sentence") and grown > MEMORY_MB:
        end = "large"
    return Outcome(end, name, detail if end not in ("read", "sentence") else "", cpu, grown)


def _judge(text: str) -> tuple[str, str]:
    """A sentence has one line that can be printed, and is not a page."""
    if text and "\n" not in text and len(text) <= MAX_SENTENCE:
        return "sentence", ""
    return "no sentence", repr(text)[:400]


def _reset_peak() -> float:
    Path("/proc/self/clear_refs").write_text("5")
    return _peak()


def _peak() -> float:
    """Largest resident memory since the reset, MB."""
    text = Path("/proc/self/status").read_text()
    return int(text.split("VmHWM:")[1].split()[0]) / 1024


def table(reports: dict[str, Report]) -> str:
    """One line a kind of file, then the faults, each kind of them once."""
    rows = [f"{'file':12} {'read':>7} {'sentences':>9} {'faults':>7} {'CPU s':>6} {'MB':>6}"]
    for kind, report in reports.items():
        good = [report.counts["read"], report.counts["sentence"], len(report.faults)]
        rows.append(f"{kind:12} {good[0]:7} {good[1]:9} {good[2]:7} {report.cpu:6.2f} {report.grown_mb:6.0f}")
    seen: Counter[tuple[str, str]] = Counter()
    for report in reports.values():
        for fault in report.faults:
            where = _place(fault)
            if not seen[fault.kind, where]:
                rows.append(f"\n{fault.kind}: {fault.seed}: {fault.detail.strip()[-900:]}")
            seen[fault.kind, where] += 1
    return "\n".join(
        [*rows, "", *(f"{count:6} {kind}: {where}" for (kind, where), count in seen.most_common())]
    )


def _place(fault: Outcome) -> str:
    """The last lines of a traceback, or the text."""
    lines = [line.strip() for line in fault.detail.strip().split("\n")]
    files = [line for line in lines if line.startswith("File ")]
    return f"{files[-1] if files else ''} {lines[-1][:60]}".strip()


def again(name: str, folder: Path) -> Any:
    """Read one mutant in this process, for a debugger; its files stay in `folder`."""
    kind, seed, number = name.split()
    sample = samples()[kind]
    write(folder, sample.mutant(mutant_rng(kind, int(seed), int(number))))
    return sample.read(folder)

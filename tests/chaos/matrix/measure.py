"""Runs one unit of the matrix and reports how it ended."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import msgspec
from tests.chaos.matrix.rows import ROOT, SoakCheck, SuiteCheck
from tests.chaos.matrix.units import Unit

from chefbot.plural import number_of
from chefbot.proving.record import RunRecord
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import Scenario
from chefbot.proving.worker import make_run_in_process

MAX_SENTENCES = 3
MAX_REASON = 160
TEST_TIME = 1800.0
"""Time after which a test file counts as hanging, s."""


class UnitResult(msgspec.Struct, frozen=True, kw_only=True):
    """How a unit ended. safe: whether what is promised held. done: whether a run's task was done as well.

    sentence: what was measured, or what broke. tries: number of tests or runs in it.
    """

    row: str
    unit: str
    safe: bool
    done: bool
    sentence: str
    tries: int
    commit: str
    date: str
    seed: int = 0


def measure(unit: Unit, commit: str, date: str, seconds: float) -> UnitResult:
    """Run a unit; a soak ends after `seconds`."""
    match unit.work:
        case SuiteCheck():
            safe, done, sentence, tries = run_tests(unit.work)
        case Scenario():
            safe, done, sentence, tries = make_run(unit.work, unit.seed)
        case SoakCheck():
            safe, done, sentence, tries = run_soak(unit.work, seconds)
    return UnitResult(
        row=unit.row,
        unit=unit.name,
        safe=safe,
        done=done,
        sentence=sentence,
        tries=tries,
        commit=commit,
        date=date,
        seed=unit.seed,
    )


def run_tests(check: SuiteCheck) -> tuple[bool, bool, str, int]:
    """Run tests in a process of their own; the sentence has the figures that they print."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n0", "-k", check.select]
        command += [
            "-o",
            "junit_family=xunit1",
            "-o",
            "junit_logging=system-out",
            "--junitxml",
            str(report),
            *check.paths,
        ]
        try:
            ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=TEST_TIME)
        except subprocess.TimeoutExpired:
            return False, False, f"not done after {TEST_TIME:.0f} s", 1
        if not report.exists():
            return False, False, f"pytest ended with {ended.returncode}: {ended.stdout[-200:]}", 1
        cases = list(ET.parse(report).getroot().iter("testcase"))
    broken = [case for case in cases if case.find("failure") is not None or case.find("error") is not None]
    tried = len(cases) - sum(case.find("skipped") is not None for case in cases)
    if broken:
        return (
            False,
            False,
            f"{len(broken)} of {number_of(tried, 'test')} failed: {broken[0].get('name')}{reason(broken[0])}",
            tried,
        )
    figures = [
        line
        for case in cases
        for line in (case.findtext("system-out") or "").splitlines()
        if "---" not in line
    ]
    sentence = (
        "; ".join(filter(None, figures[:MAX_SENTENCES]))
        or f"{number_of(tried, 'test')} {'passes' if tried == 1 else 'pass'}"
    )
    return tried > 0, tried > 0, sentence if tried else "all tests are skipped here", tried


def reason(case: ET.Element) -> str:
    """Return the first line of why a test failed, after a colon, or an empty string."""
    fault = next((found for kind in ("failure", "error") if (found := case.find(kind)) is not None), None)
    lines = (fault.get("message") or "").splitlines() if fault is not None else []
    return f": {lines[0][:MAX_REASON]}" if lines else ""


def make_run(scenario: Scenario, seed: int) -> tuple[bool, bool, str, int]:
    """Make one run on the proving ground; it is safe if its criteria are kept and no node failed."""
    spec = run_specs(scenario, Path(), [seed])[0]
    record = msgspec.json.decode(make_run_in_process(msgspec.msgpack.encode(spec)).record, type=RunRecord)
    contact = record.figures.get("contact_speed")
    bound = scenario.criteria["contact_speed"].max or 0.0
    safe = contact is not None and contact <= bound and "a node failed" not in record.failure
    touched = f"contact at {contact:.2f} m/s" if contact else ""
    sentence = "; ".join(part for part in (touched, record.failure) if part) or "task done"
    return safe, record.success, sentence, 1


def run_soak(check: SoakCheck, seconds: float) -> tuple[bool, bool, str, int]:
    """Deliver until `seconds` have passed or the simulated time is over."""
    arguments = [check.robot, check.world, str(check.hours), str(seconds)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.chaos.matrix.soak", *arguments]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    if ended.returncode:
        return False, False, f"ended with {ended.returncode}: {ended.stderr[-300:]}", 1
    found = json.loads(ended.stdout.splitlines()[-1])
    daily = found["growth"] * 24.0 / max(found["hours"], 1e-9)
    sentence = (
        f"{found['hours']:.1f} of {check.hours:g} h: {found['orders']} orders, {found['failed']} failed, "
        f"{found['contacts']} contacts, memory {found['memory']:.0f} MB, {daily:+.1%} in 24 h"
    )
    safe = found["contacts"] == 0 and found["growth"] <= check.growth
    return safe, safe and found["hours"] >= check.hours, sentence, 1

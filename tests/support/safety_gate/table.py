"""The page about the gate, and the mutants that count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import yaml

from tests.support.safety_gate.judge import Verdict
from tests.support.safety_gate.measure import ModuleCoverage
from tests.support.safety_gate.modules import REPOSITORY

PAGE = REPOSITORY / "docs" / "safety_gate.md"
EQUIVALENT = Path(__file__).with_name("equivalent.yaml")

INTRODUCTION = """# Coverage and mutants of safety

`make safety-gate` and `make safety-mutants` check the tests of all Python code between a twist and the wheels: the
safety functions (`chefbot.safety`), the limits and wheel speeds that follow from the robot file, and the three nodes
that carry them. [The safety guide](safety.md) describes what this code does. The firmware of the motor board has its
own gate.

- **Coverage**: the tests of a module reach all its lines and branches. Only its own tests count, not what others
  happen to run.
- **Mutants**: a mutant is a copy of the module with one small change: another relation, operator, number or function,
  a condition reversed, a statement removed, another result. Texts stay as they are. At least 95 % of the mutants have
  to fail the module's tests. What takes more than five times as long as the original has failed.
- A mutant that does the same as the original is listed in `tests/support/safety_gate/equivalent.yaml` with the
  reason, and does not count.

`make test` measures one module with each commit, and judges the mutants of one. Numba's kernels run as Python for it.

The project judges its mutants itself (`tests/support/safety_gate`): mutmut leaves out decorated functions, which are
all kernels and timers here, and what stands outside of functions, which are the figures; cosmic-ray starts a new
process with all imports for each mutant.
"""


def equivalents() -> list[dict[str, str]]:
    """Return the mutants that no test can distinguish from the original: module, change and reason of each."""
    return list(yaml.safe_load(EQUIVALENT.read_text()) or [])


def counted(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """Return the verdicts without those on equivalent mutants."""
    left_out = {(one["module"], one["change"]) for one in equivalents()}
    return [one for one in verdicts if (one.module, one.change) not in left_out]


def share_killed(verdicts: Sequence[Verdict]) -> float:
    """Return the share of mutants that the tests kill; 1 of none."""
    return sum(one.killed for one in verdicts) / len(verdicts) if verdicts else 1.0


def table(coverage: Sequence[ModuleCoverage], verdicts: Mapping[str, Sequence[Verdict]]) -> str:
    """Return the table of the modules, in Markdown."""
    lines = ["| module | lines | branches | mutants | killed |", "|---|---:|---:|---:|---:|"]
    for one in coverage:
        found = verdicts[one.module]
        killed = f"{sum(verdict.killed for verdict in found)} ({share_killed(found):.1%})"
        missing = f" (missing: {one.missing})" if one.missing else ""
        lines.append(f"| `{one.module}` | {one.lines}{missing} | {one.branches} | {len(found)} | {killed} |")
    every = [verdict for found in verdicts.values() for verdict in found]
    killed = f"{sum(verdict.killed for verdict in every)} ({share_killed(every):.1%})"
    totals = sum(one.lines for one in coverage), sum(one.branches for one in coverage)
    lines.append(f"| all | {totals[0]} | {totals[1]} | {len(every)} | {killed} |")
    return "\n".join(lines)


def survivors(verdicts: Sequence[Verdict]) -> str:
    """Return the mutants that survive, each with its file, line and change."""
    alive = [one for one in verdicts if not one.killed]
    return "".join(
        f"src/{one.module.replace('.', '/')}.py:{one.line} {one.function}\n"
        f"  - {one.change.partition(' -> ')[0]}\n  + {one.change.partition(' -> ')[2]}\n"
        for one in alive
    )


def write_page(coverage: Sequence[ModuleCoverage], verdicts: Mapping[str, Sequence[Verdict]]) -> None:
    """Write the page with the figures of all modules."""
    every = [verdict for found in verdicts.values() for verdict in found]
    text = [INTRODUCTION, "## Result\n", table(coverage, verdicts) + "\n"]
    alive = survivors(every)
    if alive:
        text += ["## Mutants that survive\n", f"```text\n{alive}```\n"]
    PAGE.write_text("\n".join(text))

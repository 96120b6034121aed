"""Comparison of the runs of two versions, paired by scenario and seed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from chefbot.proving.figures import FIGURES
from chefbot.proving.record import RunRecord
from chefbot.proving.scenario import is_judging
from chefbot.proving.statistics import Difference, paired_difference


class FigureChange(NamedTuple):
    """The change of a figure in a scenario; `success` is the share of successful runs."""

    scenario: str
    figure: str
    old: float
    new: float
    difference: Difference
    better: int
    """Sign of a change for the better; 0 if neither sign is."""

    @property
    def is_better(self) -> bool:
        """Whether it got significantly better."""
        return self.difference.is_significant and self.difference.mean * self.better > 0

    @property
    def is_worse(self) -> bool:
        """Whether it got significantly worse."""
        return self.difference.is_significant and self.difference.mean * self.better < 0


def changes(old: Sequence[RunRecord], new: Sequence[RunRecord]) -> list[FigureChange]:
    """Return the changes of success and of all figures, over the odd seeds that both versions have run.

    Where no odd seed is in both, the even ones are compared.
    """
    before = {(record.scenario, record.seed): record for record in old}
    pairs = [(before[key], record) for record in new if (key := (record.scenario, record.seed)) in before]
    result = []
    for scenario in sorted({record.scenario for record in new}):
        of_scenario = [pair for pair in pairs if pair[1].scenario == scenario]
        judging = [pair for pair in of_scenario if is_judging(pair[1].seed)]
        result += _changes_of(scenario, judging or of_scenario)
    return result


def _changes_of(scenario: str, pairs: list[tuple[RunRecord, RunRecord]]) -> list[FigureChange]:
    if not pairs:
        return []
    success = [(float(a.success), float(b.success)) for a, b in pairs]
    result = [_change(scenario, "success", success, 1)]
    for name, figure in FIGURES.items():
        # A failed run's figures say little about those of a successful one
        both = [
            (a.figures[name], b.figures[name])
            for a, b in pairs
            if name in a.figures and name in b.figures and a.success and b.success
        ]
        if both:
            result.append(_change(scenario, name, both, figure.better))
    return result


def _change(scenario: str, figure: str, values: list[tuple[float, float]], better: int) -> FigureChange:
    old, new = [a for a, _ in values], [b for _, b in values]
    difference = paired_difference(old, new)
    return FigureChange(scenario, figure, sum(old) / len(old), sum(new) / len(new), difference, better)

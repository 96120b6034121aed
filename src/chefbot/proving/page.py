"""The page of a proof: one HTML file with all tables and pictures."""

from __future__ import annotations

import html
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from statistics import median

from chefbot import __version__
from chefbot.plural import number_of
from chefbot.proving.comparison import FigureChange
from chefbot.proving.figures import FIGURES
from chefbot.proving.pictures import distributions, path_picture
from chefbot.proving.record import RunRecord
from chefbot.proving.results_folder import SCENARIOS
from chefbot.proving.scenario import Scenario, is_judging
from chefbot.proving.statistics import wilson

DETAILED_RUNS = 10
"""Number of runs that are shown in detail."""
JUDGED = "odd: judged"
TUNING = "even: for tuning, not judged"
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "table{border-collapse:collapse}th,td{text-align:left;padding:.15rem .8rem .15rem 0;vertical-align:top}"
    "td.n{text-align:right;font-variant-numeric:tabular-nums}"
    "code{background:#f3f3f3;padding:.1rem .3rem;overflow-wrap:anywhere}"
    ".bad{color:#c8432b}.good{color:#1c7c3c}.faint{color:#777}"
    ".worst{display:grid;grid-template-columns:repeat(auto-fill,minmax(20rem,1fr));gap:1rem}"
    ".worst svg{max-width:100%;height:auto}h2{margin-top:2.5rem}"
)


def page(
    scenarios: Sequence[Scenario], records: Sequence[RunRecord], changes: Sequence[FigureChange], out: Path
) -> str:
    """Return the page. out: folder of the results, for the command that makes a run again."""
    done = len(records)
    title = f"{', '.join(one.name for one in scenarios)[:200]}: {number_of(done, 'run')}"
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    body = [_summary(scenarios, records)]
    if changes:
        body.append(_comparison(changes))
    for scenario in scenarios:
        own = [record for record in records if record.scenario == scenario.name]
        if own:
            body.append(_scenario(scenario, own, out))
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{html.escape(title)}</title>"
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1>"
        f"<p class='faint'>chefbot {__version__}, {made}; {html.escape(_machines(records))}</p>"
        f"{''.join(body)}</html>\n"
    )


def _summary(scenarios: Sequence[Scenario], records: Sequence[RunRecord]) -> str:
    rows = []
    for scenario in scenarios:
        own = [record for record in records if record.scenario == scenario.name]
        for judging in (True, False):
            group = [record for record in own if is_judging(record.seed) == judging]
            if group:
                rows.append(_summary_row(scenario, group, judging))
    head = _head("scenario", "seeds", "success", "95 % interval", "claimed", "runs")
    note = "" if any(is_judging(record.seed) for record in records) else f"<p class='bad'>{TUNING}.</p>"
    return f"<h2>Success</h2>{note}<table>{head}{''.join(rows)}</table>"


def _summary_row(scenario: Scenario, group: Sequence[RunRecord], judging: bool) -> str:
    share = wilson(sum(record.success for record in group), len(group))
    missed = judging and share.value < scenario.claim
    claim = f"{scenario.claim:.0%}" if scenario.claim else "-"
    return (
        f"<tr><td><a href='#{scenario.name}'>{scenario.name}</a></td><td>{JUDGED if judging else TUNING}</td>"
        f"<td class='n{' bad' if missed else ''}'>{share.value:.0%}</td>"
        f"<td class='n'>{share.low:.0%} to {share.high:.0%}</td><td class='n'>{claim}</td>"
        f"<td class='n'>{share.successes} of {share.total}</td></tr>"
    )


def _comparison(changes: Sequence[FigureChange]) -> str:
    head = _head("scenario", "figure", "old", "new", "difference", "", "pairs")
    return (
        "<h2>Against the older results</h2><p>Paired by seed; interval of the mean difference by bootstrap, 95 %.</p>"
        f"<table>{head}{''.join(map(_change_row, changes))}</table>"
    )


def _change_row(change: FigureChange) -> str:
    kind, verdict = (
        ("good", "better") if change.is_better else ("bad", "worse") if change.is_worse else ("", "")
    )
    d = change.difference
    return (
        f"<tr class='{kind}'><td>{change.scenario}</td><td>{change.figure}</td><td class='n'>{change.old:.4g}</td>"
        f"<td class='n'>{change.new:.4g}</td><td class='n'>{d.mean:+.3g} ({d.low:+.3g} to {d.high:+.3g})</td>"
        f"<td>{verdict}</td><td class='n'>{d.pairs}</td></tr>"
    )


def _scenario(scenario: Scenario, records: Sequence[RunRecord], out: Path) -> str:
    picture = distributions(records)
    drawn = picture.decode() if picture else ""
    return (
        f"<h2 id='{scenario.name}'>{scenario.name}</h2><p>{html.escape(scenario.description)}</p>"
        f"{_figures(records)}{drawn}{_worst(scenario, records, out)}"
    )


def _figures(records: Sequence[RunRecord]) -> str:
    rows = []
    for name, figure in FIGURES.items():
        values = sorted(record.figures[name] for record in records if name in record.figures)
        if values:
            middle, low, high = median(values), values[0], values[-1]
            rows.append(
                f"<tr><td title='{html.escape(figure.meaning)}'>{name.replace('_', ' ')}</td>"
                f"<td class='n'>{middle:.4g}</td><td class='n'>{low:.4g} to {high:.4g}</td>"
                f"<td>{figure.unit}</td></tr>"
            )
    return f"<table>{_head('figure', 'median', 'range', 'unit')}{''.join(rows)}</table>"


def worst_first(records: Sequence[RunRecord]) -> list[RunRecord]:
    """Return the runs with failed ones first, then those with many incidents, then the slow ones."""
    return sorted(
        records, key=lambda record: (record.success, -len(record.incidents), -record.sim_time, record.seed)
    )


def _worst(scenario: Scenario, records: Sequence[RunRecord], out: Path) -> str:
    cards = []
    for record in worst_first(records)[:DETAILED_RUNS]:
        picture, again = path_picture(record), html.escape(again_command(scenario, record, out))
        verdict = (
            "<span class='good'>success</span>"
            if record.success
            else f"<span class='bad'>{html.escape(record.failure)}</span>"
        )
        cards.append(
            f"<div><b>seed {record.seed}</b>: {verdict}<br>{len(record.incidents)} incidents, {record.sim_time:.0f} s"
            f"{picture.decode() if picture else ''}<code>{again}</code></div>"
        )
    return f"<h3>Runs, worst first</h3><div class='worst'>{''.join(cards)}</div>"


def again_command(scenario: Scenario, record: RunRecord, out: Path) -> str:
    """Return the command that makes a run again and records its log, from the scenario kept with the results."""
    file = shlex.quote(str(out / SCENARIOS / f"{scenario.name}.yaml"))
    return f"chefbot prove {file} --seeds {record.seed} --record --out {shlex.quote(f'{out}_{record.seed}')}"


def _head(*titles: str) -> str:
    return f"<tr>{''.join(f'<th>{title}</th>' for title in titles)}</tr>"


def _machines(records: Sequence[RunRecord]) -> str:
    hosts = sorted({f"{r.machine.get('host', '?')} ({r.machine.get('processor', '?')})" for r in records})
    cpu, sim = sum(record.cpu_time for record in records), sum(record.sim_time for record in records)
    return f"{', '.join(hosts)}; {sim / 60:.0f} min simulated in {cpu / 60:.1f} min of CPU time"

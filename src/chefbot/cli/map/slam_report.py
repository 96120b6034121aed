"""The report of a SLAM run: one HTML file with its figures and pictures."""

from __future__ import annotations

import base64
import html
from pathlib import Path

import msgspec
import numpy as np

from chefbot import __version__
from chefbot.cli.map.error_rows import rows
from chefbot.cli.map.odometry_text import odometry_text
from chefbot.cli.map.slam_costs import SlamCosts
from chefbot.cli.map.slam_pictures import (
    costs_picture,
    error_picture,
    map_picture,
    odometry_picture,
    residuals_picture,
)
from chefbot.errors import ScanError
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.map_error import estimate_map_error, verdict
from chefbot.slam.offline import SlamResult
from chefbot.slam.params import GmappingParams
from chefbot.slam.systematic_errors import errors_of_drives

LISTED_CLOSURES = 10
"""Number of closures with the largest residuals that are listed."""
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "img{max-width:100%}table{border-collapse:collapse}th{text-align:left;font-weight:600}"
    "th,td{padding:.15rem 1.5rem .15rem 0;vertical-align:top}td{font-variant-numeric:tabular-nums}.faint{color:#777}"
)


def report_page(
    log: Path, params: GmappingParams | GraphSlamParams, result: SlamResult, costs: SlamCosts
) -> str:
    """Return the report as HTML."""
    algorithm = "graph" if isinstance(params, GraphSlamParams) else "gmapping"
    title = html.escape(f"{log.name}, {algorithm}")
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{title}</title><style>{_STYLE}</style>"
        f"<h1>{title}</h1><p class='faint'>chefbot {__version__}</p>{_table(summary(result, costs))}"
        f"{_picture('Map, trajectory and loop closures', map_picture(result))}"
        f"{_quality(result)}{_closures(result)}{_picture('Odometry and SLAM', odometry_picture(result))}"
        f"{_picture('Time and memory', costs_picture(costs))}"
        f"<h2>Parameters</h2>{_table(_parameters(params))}</html>\n"
    )


def summary(result: SlamResult, costs: SlamCosts) -> dict[str, str]:
    """Return the figures of the run as text, by name."""
    grid, milliseconds = result.grid, 1e3 * np.array(costs.seconds)
    path = np.array([(pose.x, pose.y) for pose in result.poses])
    rows = {
        "Scans": f"{result.scans}, {len(result.poses)} of them used",
        "Length of the trajectory": f"{np.hypot(*np.diff(path, axis=0).T).sum():.1f} m",
        "Map": (
            f"{grid.width * grid.resolution:.1f} m x {grid.height * grid.resolution:.1f} m, "
            f"{grid.resolution:g} m per cell"
        ),
        "Observed area": f"{(grid.cells >= 0).sum() * grid.resolution**2:.0f} m²",
        "Loop closures": str(len(result.closures)),
        "Correction of all ranges": f"{1e3 * result.range_offset:+.0f} mm",
        "Odometry": odometry_text(errors_of_drives(result.sessions, result.poses)),
        "No return": "no value stands out",
        "Time": f"{sum(costs.seconds):.1f} s for the scans, {costs.finish_seconds:.1f} s at the end",
        "Time of one scan": (
            f"median {np.median(milliseconds):.1f} ms, 99th percentile {np.percentile(milliseconds, 99):.1f} ms, "
            f"longest {milliseconds.max():.0f} ms"
        ),
    }
    if result.no_return is not None:
        minimum, share = result.no_return
        rows["No return"] = f"ranges of {minimum:.2f} m and more, {share:.1%} of all beams"
    if costs.memory:
        values = [megabytes for _, megabytes in costs.memory]
        rows["Memory of the process"] = f"{values[0]:.0f} MB at the first scan, {max(values):.0f} MB at most"
    return rows


def _quality(result: SlamResult) -> str:
    try:
        estimate = estimate_map_error(result.sessions, result.poses, result.range_offset)
    except ScanError as error:
        return f"<h2>Estimated error</h2><p>{html.escape(str(error))}</p>"
    picture = _picture("Estimated error", error_picture(result, estimate))
    return f"{picture}<p>{html.escape(verdict(estimate))}</p>{_table(rows(estimate))}"


def _closures(result: SlamResult) -> str:
    if not result.closures:
        return "<h2>Loop closures</h2><p>None.</p>"
    worst = sorted(result.closures, key=lambda closure: -closure.linear)[:LISTED_CLOSURES]
    rows = "".join(
        f"<tr><td>{c.of}</td><td>{c.to}</td><td>{1e2 * c.linear:.1f} cm</td>"
        f"<td>{np.degrees(c.angular):.2f}&deg;</td></tr>"
        for c in worst
    )
    head = "<tr><th>scan</th><th>to scan</th><th>distance</th><th>angle</th></tr>"
    return (
        f"{_picture('Residuals of the loop closures', residuals_picture(result))}"
        f"<p>The largest of {len(result.closures)}; scan numbers count the used scans only.</p>"
        f"<table>{head}{rows}</table>"
    )


def _parameters(params: GmappingParams | GraphSlamParams) -> dict[str, str]:
    """Return the parameters by name; those of a group are named GROUP.NAME."""
    rows = {}
    for name, value in msgspec.to_builtins(params).items():
        group = (
            {f"{name}.{key}": one for key, one in value.items()} if isinstance(value, dict) else {name: value}
        )
        rows.update({key: f"{one:g}" for key, one in group.items()})
    return rows


def _table(rows: dict[str, str]) -> str:
    body = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>" for name, text in rows.items()
    )
    return f"<table>{body}</table>"


def _picture(title: str, png: bytes) -> str:
    data = base64.b64encode(png).decode()
    return f"<h2>{title}</h2><img alt='{title}' src='data:image/png;base64,{data}'>"

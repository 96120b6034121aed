"""The estimated error of a map as rows of text."""

from __future__ import annotations

from chefbot.slam.map_error import MapErrorEstimate, MapRegion, centimetres

WORST = 5
"""Number of regions that are listed."""


def rows(estimate: MapErrorEstimate) -> dict[str, str]:
    """Return the figures of an estimate as text, by name, and its worst regions."""
    figures = {
        "possible drift": centimetres(estimate.drift),
        "contradictions": centimetres(estimate.contradiction),
        "walls seen on two passes": f"{estimate.compared:.0%}",
    }
    worst = sorted(estimate.regions, key=lambda region: -region.error)[:WORST]
    return figures | {f"around ({x:g}, {y:g})": text for x, y, text in map(_region, worst)}


def _region(region: MapRegion) -> tuple[float, float, str]:
    """Return the centre of a region, m, and its error with the cause."""
    x, y = region.centre
    return x, y, f"{centimetres(region.error)}: {region.cause}"

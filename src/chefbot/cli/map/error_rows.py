"""The estimated error of a map as rows of text."""

from __future__ import annotations

from collections.abc import Sequence

from chefbot.slam.map_error import REGION, MapErrorEstimate, MapRegion, centimetres

LISTED_REGIONS = 5
"""Number of regions that are listed."""


def rows(estimate: MapErrorEstimate) -> dict[str, str]:
    """Return the figures of an estimate as text, by name, and its worst regions."""
    figures = {
        "possible drift": centimetres(estimate.drift),
        "contradictions": centimetres(estimate.contradiction),
        "walls seen on two passes": f"{estimate.compared:.0%}",
    }
    worst = worst_regions(estimate.regions)
    return figures | {f"around ({x:g}, {y:g})": text for x, y, text in map(_region, worst)}


def worst_regions(regions: Sequence[MapRegion]) -> list[MapRegion]:
    """Return the regions with the largest errors, one of those that lie side by side."""
    found: list[MapRegion] = []
    for region in sorted(regions, key=lambda region: -region.error):
        if len(found) < LISTED_REGIONS and not any(_are_neighbours(region, other) for other in found):
            found.append(region)
    return found


def _are_neighbours(a: MapRegion, b: MapRegion) -> bool:
    return max(abs(a.x - b.x), abs(a.y - b.y)) < 1.5 * REGION


def _region(region: MapRegion) -> tuple[float, float, str]:
    """Return the centre of a region, m, and its error with the cause."""
    x, y = region.centre
    return x, y, f"{centimetres(region.error)}: {region.cause}"

"""The estimated error of a map in words."""

from __future__ import annotations

from chefbot.slam.map_error.estimate import MapErrorEstimate

MAX_GOOD_ERROR, MAX_USABLE_ERROR = 0.1, 0.3
"""Error up to which a map is good, and up to which a robot localizes and drives in it with care, m."""


def verdict(estimate: MapErrorEstimate) -> str:
    """Return a sentence for the owner of the building."""
    error = centimetres(estimate.error)
    if estimate.error <= MAX_GOOD_ERROR:
        return f"The map is good: its estimated error is {error}."
    if estimate.error <= MAX_USABLE_ERROR:
        return f"The map is usable: its estimated error is {error}. Drive once more where it is worst."
    return (
        f"The map is bad: its estimated error is {error}. Map again, and return to places you have been at."
    )


def centimetres(error: float) -> str:
    """Return an error as text."""
    return f"{100 * error:.0f} cm" if error < 1.0 else f"{error:.1f} m"

"""The colours of the style sheet, in light and dark: text has the contrast of WCAG 2.1, level AA."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import chefbot.ui

SHEET = (Path(chefbot.ui.__file__).parent / "static" / "style.css").read_text()
MIN_CONTRAST, CURVES = 4.5, 8
WAITS_SHARE = 0.1
"""Share of the accent in the card of the round while the robot waits for a person."""
Colour = tuple[float, ...]


def colours(scheme: str) -> dict[str, Colour]:
    """Return the colours of a scheme by name, 0 to 1 each; those that only `light` defines hold in `dark`, too."""
    light, dark = re.findall(r":root \{(.*?)\}", SHEET, re.S)[:2]
    text = light if scheme == "light" else light + dark
    found = re.findall(r"--([a-z0-9-]+): #([0-9a-f]{6});", text)
    return {name: tuple(int(value[i : i + 2], 16) / 255 for i in (0, 2, 4)) for name, value in found}


def luminance(colour: Colour) -> float:
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: Colour, other: Colour) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_from_what_is_behind_it(scheme: str) -> None:
    of = colours(scheme)
    accent, card = of["accent"], of["card"]
    of["waits"] = tuple(WAITS_SHARE * a + (1.0 - WAITS_SHARE) * c for a, c in zip(accent, card, strict=True))
    pairs = [(ink, back) for ink in ("ink", "quiet") for back in ("ground", "card", "waits")]
    pairs += [("accent-ink", "accent"), ("accent", "card"), ("warn-ink", "warn")]
    pairs += [(f"curve-{i}", "card") for i in range(CURVES)]
    weak = {pair: round(contrast(of[pair[0]], of[pair[1]]), 2) for pair in pairs}
    assert {pair: value for pair, value in weak.items() if value < MIN_CONTRAST} == {}


def test_the_share_of_the_accent_is_that_of_the_sheet() -> None:
    assert f"color-mix(in srgb, var(--accent) {round(100 * WAITS_SHARE)}%, var(--card))" in SHEET


def test_black_on_white_has_the_largest_contrast() -> None:
    assert contrast((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)) == pytest.approx(21.0)

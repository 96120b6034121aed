"""Tests that the map itself is changed on the page: strokes, a crop, a rotation, each with the robot's preview."""

from __future__ import annotations

import math
from typing import Any

import pytest
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab
from tests.ui.test_map_edit import edited as edited
from tests.ui.test_map_edit import opened, press, text_of

from chefbot.msgs.chefbot_msgs import MapEditResult
from chefbot.ui import commands as do
from chefbot.ui.map_commands import CropMap, DrawOnMap, RotateMap


def next_change(page: Any, kind: type[do.OperatorCommand], *, preview: bool) -> Any:
    """The next command of a kind, a preview or not."""
    while True:
        command = page.next_command()
        if isinstance(command, kind) and command.preview == preview:  # type: ignore[attr-defined]
            return command


@pytest.mark.slow
@needs_chromium
def test_strokes_are_previewed_taken_back_and_saved(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.getElementById('brush-start').click()")
        assert tab.evaluate("document.getElementById('drawing-save').disabled")
        press(tab, 0.4, 0.4, (0.6, 0.4))
        press(tab, 0.4, 0.6, (0.6, 0.6))
        preview = next_change(edited, DrawOnMap, preview=True)
        while len(preview.strokes) < 2:
            preview = next_change(edited, DrawOnMap, preview=True)
        (first, second), (ax, ay) = preview.strokes, preview.strokes[0][0]
        assert first[-1][0] > ax and first[-1][1] == pytest.approx(ay) and second[0][1] < ay
        assert (preview.brush, preview.width) == ("wall", 0.1)
        edited.server.set_layer(
            "edits", (MapEditResult(preview.id, description="No path from the robot to: bar."),)
        )
        tab.wait_for(f"{text_of('drawing-effects')} === 'No path from the robot to: bar.'")
        tab.evaluate("document.getElementById('stroke-back').click()")
        tab.evaluate("document.getElementById('brush-value').value = 'free'")
        tab.evaluate("document.getElementById('drawing-save').click()")
        change = next_change(edited, DrawOnMap, preview=False)
        assert change.strokes == [first] and change.brush == "free"
        edited.server.set_layer("edits", (MapEditResult(change.id, applied=True, undoable=2),))
        tab.wait_for(f"{text_of('edit-note')}.startsWith('Saved.')")
        assert tab.evaluate("document.getElementById('drawing-form').hidden") and tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_a_crop_has_two_corners_and_a_refusal_is_shown(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.getElementById('crop-start').click()")
        press(tab, 0.3, 0.7, (0.7, 0.3))
        crop = next_change(edited, CropMap, preview=True)
        assert crop.other_x > crop.x and crop.other_y > crop.y
        tab.evaluate("document.getElementById('drawing-save').click()")
        change = next_change(edited, CropMap, preview=False)
        assert (change.x, change.y, change.other_x) == (crop.x, crop.y, crop.other_x)
        preview = MapEditResult(crop.id, description="bar lies outside the map")
        edited.server.set_layer(
            "edits", (MapEditResult(change.id, description="bar lies outside the map"), preview)
        )
        tab.wait_for(f"{text_of('drawing-effects')} === 'Not saved: bar lies outside the map'")
        assert not tab.evaluate("document.getElementById('drawing-form').hidden")
        tab.evaluate("document.getElementById('brush-start').click()")
        tab.evaluate(
            "(() => { const width = document.getElementById('brush-width'); width.value = '-3'; width.oninput(); })()"
        )
        assert tab.evaluate(text_of("drawing-effects")).startswith("The width of a brush is 0.05 to 5 m")
        assert tab.evaluate("document.getElementById('drawing-save').disabled")
        tab.evaluate("document.getElementById('place-new').click()")
        assert tab.evaluate("document.getElementById('drawing-form').hidden")


@pytest.mark.slow
@needs_chromium
def test_a_rotation_is_given_in_degrees(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.getElementById('rotate-start').click()")
        tab.evaluate(
            "(() => { const angle = document.getElementById('rotate-angle');"
            " angle.value = '-1.5'; angle.oninput(); })()"
        )
        assert next_change(edited, RotateMap, preview=True).angle == pytest.approx(-1.5 * math.pi / 180)
        tab.evaluate("document.getElementById('drawing-save').click()")
        assert next_change(edited, RotateMap, preview=False).angle == pytest.approx(-1.5 * math.pi / 180)

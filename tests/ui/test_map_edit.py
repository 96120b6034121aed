"""Tests that places and zones are changed by pressing on the map, with the robot's answer shown."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from tests.support.web_ui import MAP_SHOWN, show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.msgs.chefbot_msgs import MapEditResult
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.ui import commands as do
from chefbot.ui.display.message_conversion import zone_views

UP = "!document.body.classList.contains('offline')"
OPEN = "document.getElementById('edit-tab').click()"
STAIRS = MapZone("stairs", KEEP_OUT, tuple(Point(x, y, 0.0) for x, y in ((3.0, 2.0), (5.0, 2.0), (5.0, 4.0))))


def text_of(name: str) -> str:
    return f"document.getElementById('{name}').textContent"


@pytest.fixture
def edited(page: Any) -> Any:
    """A page with a map that can be changed."""
    show_a_room(page.server)
    page.server.set_layer("labels", {"table_2": "窗边 二"})
    page.server.set_layer("zones", zone_views(MapZones(zones=(STAIRS,))))
    page.server.set_layer("edits", (MapEditResult(undoable=1),))
    return page


def opened(tab: Tab) -> None:
    tab.wait_for(f"{UP} && !document.getElementById('edit-tab').hidden && {MAP_SHOWN}")
    tab.evaluate("document.getElementById('fit').click()")
    tab.evaluate(OPEN)


def press(tab: Tab, x: float, y: float, to: tuple[float, float] | None = None) -> None:
    """Press on the map at a share of its width and height, and drag to another."""
    left, top, width, height = tab.evaluate(
        "(() => { const { left, top, width, height } = canvas.getBoundingClientRect();"
        " return [left, top, width, height]; })()"
    )
    tab.mouse("mousePressed", left + x * width, top + y * height)
    end = to or (x, y)
    tab.mouse("mouseMoved", left + end[0] * width, top + end[1] * height)
    tab.mouse("mouseReleased", left + end[0] * width, top + end[1] * height)


@pytest.mark.slow
@needs_chromium
def test_the_effect_of_a_zone_is_shown_before_it_is_saved(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.getElementById('zone-new').click()")
        tab.wait_for(f"{text_of('zone-effects')}.includes('three or more corners')")
        assert tab.evaluate("document.getElementById('zone-save').disabled")
        for corner in ((0.4, 0.4), (0.6, 0.4), (0.6, 0.6)):
            press(tab, *corner)
        preview = edited.next_command()
        assert isinstance(preview, do.PutZone) and preview.preview and len(preview.corners) == 3
        (ax, ay), (bx, by), (cx, cy) = preview.corners
        assert ax < bx == pytest.approx(cx) and ay == pytest.approx(by) and cy < by
        edited.server.set_layer(
            "edits", (MapEditResult(preview.id, description="No path from the robot to: table_2."),)
        )
        tab.wait_for(f"{text_of('zone-effects')} === 'No path from the robot to: 窗边 二.'")
        tab.evaluate("document.getElementById('zone-save').click()")
        saved = edited.next_command()
        assert isinstance(saved, do.PutZone) and saved.corners == preview.corners and not saved.preview
        edited.server.set_layer("edits", (MapEditResult(saved.id, applied=True, undoable=2),))
        tab.wait_for(
            f"{text_of('edit-note')}.startsWith('Saved.') && document.getElementById('zone-form').hidden"
        )
        assert tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_a_place_gets_a_label_in_any_script(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.getElementById('place-new').click()")
        press(tab, 0.5, 0.5, (0.5, 0.3))
        tab.wait_for("!document.getElementById('place-form').hidden")
        tab.evaluate("document.getElementById('place-kind').value = 'room'")
        tab.evaluate("document.getElementById('place-label').value = 'غرفة ٣'")
        tab.evaluate("document.querySelector('#place-form .primary').click()")
        command = edited.next_command()
        assert isinstance(command, do.PutPlace)
        assert (command.name, command.kind, command.label) == ("", "room", "غرفة ٣")
        assert command.yaw == pytest.approx(math.pi / 2, abs=0.1)
        edited.server.set_layer("edits", (MapEditResult(command.id, description="غرفة ٣ lies in a wall"),))
        tab.wait_for(f"{text_of('edit-note')} === 'Not saved: غرفة ٣ lies in a wall'")
        assert not tab.evaluate("document.getElementById('place-form').hidden"), (
            "nothing is lost on a refusal"
        )


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize(("button", "form"), [("zone-new", "zone-form"), ("rotate-start", "drawing-form")])
def test_a_form_opens_with_its_buttons_in_sight(edited: Any, button: str, form: str) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        tab.resize(390, 844)
        opened(tab)
        tab.evaluate(f"document.getElementById('{button}').scrollIntoView({{ block: 'end' }})")
        tab.evaluate(f"document.getElementById('{button}').click()")
        shown = (
            f"[document.getElementById('{form}'), panels].map((one) => one.getBoundingClientRect().bottom)"
        )
        lower_edge, visible = tab.evaluate(shown)
        assert lower_edge <= visible + 1


@pytest.mark.slow
@needs_chromium
def test_labels_are_shown_instead_of_names(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.wait_for(
            "[...document.querySelectorAll('#tables button')].some((one) => one.textContent === '窗边 二')"
        )
        known = "import('./language.js').then((module) => module.translated('On the way to table 2, then table_20.'))"
        assert tab.evaluate(known) == "On the way to 窗边 二, then table_20."
        edited.server.set_layer("labels", {})
        tab.wait_for(
            "[...document.querySelectorAll('#tables button')].some((one) => one.textContent === 'Table 2')"
        )


@pytest.mark.slow
@needs_chromium
def test_a_form_whose_zone_was_removed_has_a_note(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.querySelector('#zone-list button').click()")
        assert "removed" not in tab.evaluate(text_of("edit-note"))
        edited.server.set_layer("zones", ())
        tab.wait_for(f"{text_of('edit-note')}.endsWith('was removed in the meantime; saving adds it again.')")
        assert not tab.evaluate("document.getElementById('zone-form').hidden")


@pytest.mark.slow
@needs_chromium
def test_what_exists_is_moved_deleted_and_taken_back(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.querySelector('#zone-list button').click()")
        tab.evaluate("document.getElementById('zone-delete').click()")
        command = edited.next_command()
        while isinstance(command, do.PutZone):  # the preview of the zone as it is
            command = edited.next_command()
        assert isinstance(command, do.DeleteZone) and command.name == "stairs"
        tab.evaluate("document.querySelectorAll('#place-list button')[1].click()")
        tab.evaluate("document.getElementById('place-move').click()")
        press(tab, 0.6, 0.6)
        tab.evaluate("document.querySelector('#place-form .primary').click()")
        moved = edited.next_command()
        assert isinstance(moved, do.PutPlace) and (moved.name, moved.label) == ("table_2", "窗边 二")
        assert moved.moved and moved.yaw == 0.0, "a press without a drag keeps the direction"
        tab.evaluate("document.querySelectorAll('#place-list button')[0].click()")
        tab.evaluate("document.getElementById('place-label').value = 'Bar'")
        tab.evaluate("document.querySelector('#place-form .primary').click()")
        labelled = edited.next_command()
        assert isinstance(labelled, do.PutPlace) and (labelled.label, labelled.moved) == ("Bar", False)
        tab.evaluate("document.getElementById('undo-edit').click()")
        assert isinstance(edited.next_command(), do.UndoMapEdit)


@pytest.mark.slow
@needs_chromium
def test_another_persons_change_is_not_overwritten(edited: Any) -> None:
    """What the form was opened on counts, not what came since; the button names what it would undo."""
    last = MapEditResult("x", undoable=1, last_id="x", last_change="窗边 二 was moved", last_edited_by="Max")
    edited.server.set_layer("edits", (last,))
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.wait_for(f"{text_of('undo-edit')} === 'Undo: 窗边 二 was moved (Max)'")
        tab.evaluate("document.querySelectorAll('#place-list button')[0].click()")
        edited.server.set_layer(
            "edits", (msgspec.structs.replace(last, id="y", last_id="y", last_edited_by=""),)
        )
        tab.wait_for(f"{text_of('undo-edit')} === 'Undo: 窗边 二 was moved'")
        changed = "The map has changed in the meantime; look at it and press again"
        for seen, newest in (("x", "z"), ("z", "z")):  # refused, and then pressed again
            tab.evaluate("document.querySelector('#place-form .primary').click()")
            saved = edited.next_command()
            assert isinstance(saved, do.PutPlace) and saved.seen_change == seen
            edited.server.set_layer("edits", (MapEditResult(saved.id, description=changed, last_id=newest),))
            tab.wait_for(f"{text_of('edit-note')} === 'Not saved: {changed}'")
        tab.evaluate("document.getElementById('zone-new').click()")
        edited.server.set_layer("edits", (msgspec.structs.replace(last, id="w", last_id="w"),))
        tab.wait_for(f"{text_of('undo-edit')}.includes('Max')")
        tab.evaluate("document.getElementById('undo-edit').click()")
        undo = edited.next_command()
        assert isinstance(undo, do.UndoMapEdit) and undo.seen_change == "w"
        edited.server.set_layer("edits", (MapEditResult(undo.id, description=changed, last_id="v"),))
        tab.wait_for(f"{text_of('edit-note')} === 'Not undone: {changed}'")


@pytest.mark.slow
@needs_chromium
def test_results_of_two_people_arrive_together(edited: Any) -> None:
    """A browser gets the latest value of a layer only; its own result may be the older one."""
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.querySelectorAll('#place-list button')[0].click()")
        tab.evaluate("document.querySelector('#place-form .primary').click()")
        saved = edited.next_command()
        other = MapEditResult("other", applied=True, undoable=3, last_id="other", last_change="bar was added")
        edited.server.set_layer("edits", (other, MapEditResult(saved.id, applied=True)))
        tab.wait_for(f"{text_of('edit-note')}.startsWith('Saved.')")
        assert tab.evaluate(text_of("undo-edit")) == "Undo: bar was added"
        # a place that is called otherwise now is named as before
        renamed = MapEditResult("r", applied=True, undoable=4, last_change="Table 2 was renamed 窗边 二")
        edited.server.set_layer("edits", (renamed,))
        tab.wait_for(f"{text_of('undo-edit')} === 'Undo: Table 2 was renamed 窗边 二'")


@pytest.mark.slow
@needs_chromium
def test_a_zone_is_previewed_again_after_another_change(edited: Any) -> None:
    with open_tab(edited.url, NO_GPU) as tab:
        opened(tab)
        tab.evaluate("document.querySelector('#zone-list button').click()")
        preview = edited.next_command()
        edited.server.set_layer("edits", (MapEditResult(preview.id),))
        tab.wait_for(f"{text_of('zone-effects')} === 'No place is cut off.'")
        edited.server.set_layer("edits", (MapEditResult("other", applied=True), MapEditResult(preview.id)))
        again = edited.next_command()
        assert isinstance(again, do.PutZone) and again.preview and again.id != preview.id


@pytest.mark.slow
@needs_chromium
def test_distances_and_coordinates_are_read_from_the_map(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("robot", None)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{UP} && {MAP_SHOWN}")
        tab.evaluate("document.getElementById('fit').click()")
        tab.evaluate(
            "window.texts = []; const write = CanvasRenderingContext2D.prototype.fillText;"
            "CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {"
            " window.texts.push(text); return write.call(this, text, ...at); }; undefined"
        )
        tab.evaluate("document.querySelector('[data-tool=measure]').click()")
        press(tab, 0.3, 0.5, (0.6, 0.5))
        at = float(str(tab.evaluate(text_of("cursor"))).split()[1])
        tab.wait_for("window.texts.some((text) => /^\\d+\\.\\d\\d m, 0°$/.test(text))")
        measured = tab.evaluate("window.texts.filter((text) => text.endsWith('m, 0°')).map(parseFloat)")
        press(tab, 0.3, 0.5)
        start = float(str(tab.evaluate(text_of("cursor"))).split()[1])
        assert max(measured) == pytest.approx(at - start, abs=0.02) and at > start
        assert page.commands.empty()


@pytest.mark.slow
@needs_chromium
def test_the_map_is_changed_only_where_a_map_server_runs(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{UP} && {MAP_SHOWN}")
        assert tab.evaluate(
            "document.getElementById('edit-tab').hidden && document.getElementById('edit-map').hidden"
        )

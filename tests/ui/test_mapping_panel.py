"""Tests that mapping is begun, dropped and saved in the web UI."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab
from tests.ui.test_map_edit import UP, text_of

from chefbot.ui.commands import DriveOnMap, Explore, MapBuilding, OperatorCommand, ResetMap, SaveMap
from chefbot.ui.display.views import DeliveryView, LaunchView, MappingView, SaveOutcome

RESTART = "The robot's programs start again …"


def next_of(page: Any, kind: type[OperatorCommand]) -> Any:
    while not isinstance(command := page.next_command(), kind):
        pass
    return command


def clicked(name: str) -> str:
    return f"document.getElementById('{name}').click()"


@pytest.mark.slow
@needs_chromium
def test_mapping_is_offered_only_with_an_explorer(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{UP} && document.querySelectorAll('#tables button').length === 2")
        assert tab.evaluate("document.getElementById('edit-tab').hidden")
        page.server.set_layer("mapping", MappingView(description="Ready to explore."))
        tab.wait_for("!document.getElementById('edit-tab').hidden")
        assert not tab.evaluate("document.getElementById('edit-box').checkVisibility()")
        assert tab.evaluate(text_of("exploration")) == "Ready to explore."
        tab.evaluate(clicked("explore"))
        assert next_of(page, Explore) == Explore(True)
        page.server.set_layer("mapping", MappingView(exploring=True, description="Exploring."))
        tab.wait_for(f"{text_of('explore')} === 'End the exploration'")
        tab.evaluate(clicked("explore"))
        assert next_of(page, Explore) == Explore(False)
        tab.evaluate(clicked("reset-map"))
        tab.evaluate(clicked("reset-map-sure"))
        assert next_of(page, ResetMap) == ResetMap()
        assert tab.evaluate("document.getElementById('reset-map-sure').hidden") and tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_a_map_of_the_same_name_is_replaced_by_a_second_press(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("mapping", MappingView())
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{UP} && !document.getElementById('mapping-box').hidden")
        for name, sent in (("Ground floor", False), ("ground_floor", True)):
            tab.evaluate(f"document.getElementById('map-name').value = '{name}'")
            assert tab.evaluate("document.getElementById('save-map-form').checkValidity()") == sent
        tab.evaluate("document.getElementById('save-map-form').requestSubmit()")
        known = "There is a map called ground_floor already."
        others, first = SaveOutcome("other", "Saved. To use it: y."), next_of(page, SaveMap)
        assert first == SaveMap("ground_floor", id=first.id) and first.id
        page.server.set_layer("mapping", MappingView(outcomes=(SaveOutcome(first.id, known), others)))
        tab.wait_for("!document.getElementById('replace-map').hidden")
        tab.evaluate("document.getElementById('map-name').oninput()")
        assert tab.evaluate("document.getElementById('replace-map').hidden"), "another name was typed"
        tab.evaluate("document.getElementById('save-map-form').requestSubmit()")
        second = next_of(page, SaveMap)
        assert second == SaveMap("ground_floor", id=second.id) and second.id != first.id
        page.server.set_layer("mapping", MappingView(outcomes=(SaveOutcome(second.id, known),)))
        tab.wait_for("!document.getElementById('replace-map').hidden")
        tab.evaluate(clicked("replace-map"))
        third = next_of(page, SaveMap)
        assert third == SaveMap("ground_floor", replace=True, id=third.id)
        page.server.set_layer(
            "mapping", MappingView(outcomes=(SaveOutcome(third.id, "Saved. To use it: x."),))
        )
        tab.wait_for(f"{text_of('mapping-note')}.startsWith('Saved.')")
        assert tab.evaluate("document.getElementById('replace-map').hidden")


@pytest.mark.slow
@needs_chromium
def test_mapping_is_begun_and_ended_on_a_saved_map(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{UP} && document.querySelectorAll('#tables button').length === 2")
        page.server.set_layer("launch", LaunchView(mapping=False))
        tab.wait_for("!document.getElementById('launch-box').hidden")
        assert tab.evaluate("document.getElementById('continue-map').hidden")
        page.server.set_layer("launch", LaunchView(mapping=False, can_continue=True))
        tab.wait_for("!document.getElementById('continue-map').hidden")
        for name, continued in (("map-building", False), ("continue-map", True)):
            tab.evaluate(clicked(name))
            assert not tab.evaluate("document.getElementById('map-sure').hidden")
            tab.evaluate(clicked("map-sure"))
            assert next_of(page, MapBuilding) == MapBuilding(continued)
        tab.evaluate(clicked("map-building"))
        page.server.set_layer("delivery", DeliveryView(state="driving", round_active=True))
        tab.wait_for("document.getElementById('map-sure').hidden")  # it would be refused
        tab.evaluate(clicked("continue-map"))
        assert tab.evaluate("document.getElementById('map-sure').hidden")
        assert tab.evaluate(text_of("launch-note")) == "A delivery round is active; end it first."
        page.server.set_layer("delivery", DeliveryView())
        page.server.set_layer("launch", LaunchView(mapping=False, notice="gmapping_demo cannot run."))
        tab.wait_for(f"{text_of('launch-note')} === 'gmapping_demo cannot run.'")
        page.server.set_layer("launch", LaunchView(mapping=True))
        page.server.set_layer("mapping", MappingView())
        tab.wait_for("document.getElementById('launch-box').hidden")
        assert tab.evaluate("document.getElementById('drive-on-map').hidden")  # nothing is saved yet
        page.server.set_layer("mapping", MappingView(saved="hall", mapper="The mapper receives scans again."))
        tab.wait_for("!document.getElementById('drive-on-map').hidden")
        assert tab.evaluate(text_of("drive-on-map")) == "End mapping and use the map hall"
        assert tab.evaluate(text_of("mapper")) == "The mapper receives scans again."
        tab.evaluate(clicked("drive-on-map"))
        tab.evaluate(clicked("drive-on-map-sure"))
        assert next_of(page, DriveOnMap) == DriveOnMap("hall") and tab.errors() == []
        page.server.set_layer("launch", LaunchView(mapping=True, ends=True))
        tab.wait_for(f'{text_of("mapping-note")} === "{RESTART}"')
        page.server.stop()
        tab.wait_for(f'{text_of("notice")} === "{RESTART}"')  # and not that the connection was lost

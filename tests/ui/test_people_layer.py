"""Tests that tracked people are drawn on the map with number and velocity."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab, pixels

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Vector3
from chefbot.ui.display.message_conversion import people_views
from chefbot.ui.display.views import PersonView
from chefbot.ui.layers import LAYERS

PERSON = PersonView(id=7, x=4.0, y=3.0, vx=1.0, vy=0.0, deviation=0.1, visible=True)
PINK = pixels(190, 24, 93)
"""Number of pixels in the colour of people."""


def test_positions_and_velocities_are_rotated_into_the_map() -> None:
    covariance = np.diag([0.04, 0.09, 1.0, 1.0]).reshape(16)
    person = TrackedPerson(3, Point(1.0, 0.0), Vector3(0.5, 0.0), covariance, visible=True)
    (view,) = people_views(TrackedPeople(people=(person,)), SE2(2.0, 1.0, math.pi / 2))
    expected = (3, 2.0, 2.0, 0.0, 0.5, 0.3, True)
    got = (view.id, view.x, view.y, view.vx, view.vy, view.deviation, view.visible)
    assert got == pytest.approx(expected)


def test_the_layer_takes_nothing_but_people() -> None:
    assert LAYERS["people"].validate([PERSON]) == (PERSON,)
    with pytest.raises(TypeError):
        LAYERS["people"].validate([(4.0, 3.0)])


@pytest.mark.slow
@needs_chromium
def test_people_are_drawn_until_they_are_gone(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("people", (PERSON,))
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(f"{PINK} > 50")
        one = tab.evaluate(PINK)
        page.server.set_layer(
            "people", (PERSON, PersonView(id=8, x=6.0, y=2.0, vx=0.0, vy=0.0, deviation=0.4, visible=True))
        )
        tab.wait_for(f"{PINK} > {one} + 50")
        page.server.set_layer("people", ())
        tab.wait_for(f"{PINK} === 0")

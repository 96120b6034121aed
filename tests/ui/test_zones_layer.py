"""Tests that the zones of the map are drawn in the web UI."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab, pixels

from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.ui.display.message_conversion import zone_views
from chefbot.ui.display.views import ZoneView
from chefbot.ui.layers import LAYERS

CORNERS = tuple(Point(x, y, 0.0) for x, y in ((3.0, 2.0), (5.0, 2.0), (5.0, 4.0)))
RED = pixels(185, 28, 28)
"""Number of pixels in the colour of keep-out zones."""


def test_zones_are_converted_with_title_and_corners() -> None:
    message = MapZones(zones=(MapZone("one_way_2", ONE_WAY, CORNERS, 0.0, 1.5),))
    expected = ZoneView(
        title="one-way lane 2",
        name="one_way_2",
        kind="one_way",
        corners=((3.0, 2.0), (5.0, 2.0), (5.0, 4.0)),
        direction=1.5,
        speed=0.0,
    )
    assert zone_views(message) == (expected,)


def test_the_layer_takes_nothing_but_zones() -> None:
    zones = zone_views(MapZones(zones=(MapZone("stairs", KEEP_OUT, CORNERS),)))
    assert LAYERS["zones"].validate(zones) == zones
    with pytest.raises(TypeError):
        LAYERS["zones"].validate(["stairs"])


@pytest.mark.slow
@needs_chromium
def test_zones_are_drawn(page: Any) -> None:
    show_a_room(page.server)
    zones = (MapZone("stairs", KEEP_OUT, CORNERS),)
    with open_tab(page.url, NO_GPU) as tab:
        page.server.set_layer("zones", zone_views(MapZones(zones=zones)))
        tab.wait_for(f"{RED} > 50")
        page.server.set_layer("zones", ())
        tab.wait_for(f"{RED} === 0")

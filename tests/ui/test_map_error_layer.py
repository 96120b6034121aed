"""The estimated error of the map is a layer that is off at first: green where it is small, red where it is large."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.support.web_ui import MAP_SHOWN, show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab, pixels_where

from chefbot.maths.grid import Grid
from chefbot.ui.layers import LAYERS

ERRORS = Grid(np.array([[3, 7, 15], [30, 60, -1]], np.int8), 2.0, 0.0, 0.0)
"""An error of each colour, cm, and one square without."""


RED, BLUE = pixels_where("r > g + 40 && r > b + 40"), pixels_where("b > r + 40 && b > g + 20")


def test_the_layer_takes_nothing_but_whole_centimetres() -> None:
    assert LAYERS["map_error"].validate(ERRORS).resolution == 2.0
    with pytest.raises(TypeError):
        LAYERS["map_error"].validate(Grid(np.zeros((2, 2), np.uint8), 2.0, 0.0, 0.0))


@pytest.mark.slow
@needs_chromium
def test_the_error_is_drawn_where_somebody_wants_to_see_it(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("map_error", ERRORS)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(MAP_SHOWN)
        red, blue = tab.evaluate(RED), tab.evaluate(BLUE)
        tab.evaluate("document.querySelector('input[data-layer=map_error]').click()")
        tab.wait_for(f"{RED} > {red} + 500 && {BLUE} > {blue} + 500")

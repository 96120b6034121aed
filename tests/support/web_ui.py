"""Data for a web UI to show."""

from __future__ import annotations

from typing import Any

import numpy as np

from chefbot.maths.grid import Grid
from chefbot.ui.display.views import RobotView, StatusView

MAP_SHOWN = """(() => {
  const { width, height } = canvas, copy = Object.assign(document.createElement('canvas'), { width, height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const painted = context.getImageData(0, 0, width, height).data.filter((value, i) => i % 4 === 3 && value > 0);
  return document.querySelectorAll('#tables button').length > 0 && painted.length > 0.1 * width * height;
})()"""
"""Whether map and places have arrived: the view is fitted to the map when it does."""


def show_a_room(server: Any) -> None:
    cells = np.zeros((160, 240), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    server.set_layer("map", Grid(cells, 0.05, -2.0, -1.0))
    server.set_layer("robot", RobotView(x=1.0, y=1.0, yaw=0.0))
    server.set_layer("places", {"table_1": (2, 2, 0), "table_2": (4, 2, 0), "<b>kitchen</b>": (6, 2, 0)})
    server.set_layer(
        "status",
        StatusView(phase="Waiting for an order.", simulation=True, localization_error=0.05, clock=1.0),
    )

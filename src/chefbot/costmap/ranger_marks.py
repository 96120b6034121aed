"""Marks of obstacles that only the ultrasonic ranger measures, such as glass, and of those that the robot touched.

The ranger knows a distance, but not where in its cone: each cell keeps a probability of being occupied, updated by
the sensor model of Nav2's RangeSensorLayer (nav2_costmap_2d; its constants below), and is marked from a probability
on. An echo that a known obstacle in the cone explains marks nothing: door posts would otherwise close the doorway
between them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.sources import CONTACT, LASTING_SOURCES, RANGER
from chefbot.maths.costs import LETHAL, UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import Range
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap

MARKING_RANGE = 1.0
"""Maximum distance of an echo that marks, m; beyond, its arc is too wide to distinguish a doorway from a wall."""
DECAY_RANGE = 1.2
"""Distance at which the ranger's weight has halved, m (phi_v of RangeSensorLayer)."""
MARK_PROBABILITY = 0.8
"""Probability from which a cell is marked (mark_threshold of RangeSensorLayer)."""
EXPLAINED_DISTANCE = 0.12
"""Difference between an echo and a known obstacle in the cone up to which that explains it, m."""
EXPLAINED_MARGIN = 0.15
"""Angle beside the cone in which a known obstacle explains an echo, too, rad: cells are coarse, and while the robot
turns they lag behind. An echo of a table leg at the edge would otherwise mark the arc through the gap beside it."""
CONTACT_BEARINGS = (-0.35, 0.0, 0.35)
"""Bearings of the marks of a contact about the direction of motion, rad: where it was touched is not known."""
CONTACT_MARGIN = 0.03
"""Distance of the marks of a contact from the robot's outline, m."""
PRIOR = 127
"""Cost of a cell without any echo: a probability of one half."""


def mark_range(costs: LayeredCostmap, sensor: SE2, echo: Range) -> None:
    """Mark and clear with an echo from the pose `sensor`; no echo at all shows nothing, as sound is mirrored away."""
    distance = float(echo.range)
    measured = math.isfinite(distance) and echo.min_range <= distance <= echo.max_range
    if not (measured and echo.field_of_view > 0.0):
        return
    marks = distance <= MARKING_RANGE
    if not (marks or any(costs.has_source(name) for name in LASTING_SOURCES)):
        return
    reach = min(distance, MARKING_RANGE) + 2.0 * costs.resolution
    window = costs.window_around(sensor, reach).expanded(0, costs.shape)
    if window.empty:
        return
    phi, theta = _polar(costs, sensor, window.slices)
    in_cone = (np.abs(theta) <= echo.field_of_view / 2.0) & (phi <= reach)
    free = in_cone & (phi < distance - 2.0 * costs.resolution)
    if costs.has_source(CONTACT) and costs.has_source(RANGER):
        echoes = phi[in_cone & (costs.source_cells(RANGER)[window.slices] == LETHAL)]
        _clear_contacts(costs.source_cells(CONTACT)[window.slices], free, phi, echoes)
    known = costs.obstacles(window, without=(RANGER, CONTACT))
    around_cone = np.abs(theta) <= echo.field_of_view / 2.0 + EXPLAINED_MARGIN
    explains = known & around_cone & (np.abs(phi - distance) <= EXPLAINED_DISTANCE)
    marks = marks and not explains.any()
    if marks or costs.has_source(RANGER):
        cells = costs.source_cells(RANGER)[window.slices]
        updated = in_cone if marks else free
        cells[updated] = _updated(cells, phi, theta, distance, echo.field_of_view, costs.resolution)[updated]
        rows, columns = np.nonzero(updated)
        costs.note_marks(RANGER, (rows + window.slices[0].start, columns + window.slices[1].start))
    costs.note_change(sensor, reach)


def contact_radius(robot: Robot) -> float:
    """Return the distance of the marks of a contact from the middle of the robot, m: just outside its outline."""
    return robot.footprint.front + CONTACT_MARGIN


def mark_contact(costs: LayeredCostmap, contact: SE2, radius: float) -> None:
    """Mark what the robot has touched.

    contact: the robot's pose with its x axis along the motion that ended there. radius: distance of the marks from
    the middle of the robot, m.
    """
    cells = costs.source_cells(CONTACT)
    for bearing in CONTACT_BEARINGS:
        x = contact.x + radius * math.cos(contact.yaw + bearing)
        y = contact.y + radius * math.sin(contact.yaw + bearing)
        row = math.floor((y - costs.origin_y) / costs.resolution)
        column = math.floor((x - costs.origin_x) / costs.resolution)
        if 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
            cells[row, column] = LETHAL
            costs.note_marks(CONTACT, (row, column))
    costs.note_change(contact, radius)


def _clear_contacts(
    cells: NDArray[np.uint8], free: NDArray[np.bool_], phi: NDArray[np.float64], echoes: NDArray[np.float64]
) -> None:
    """Clear the contacts in a window that the ranger has marked, too, as they have left.

    What it looks past, as below a board, was there all the time. cells, free, phi (h, w): the marks, whether the cone
    is free, the distances; echoes (n,): distances of what the ranger has marked in the cone, m.
    """
    rows, columns = np.nonzero(free & (cells == LETHAL))
    if len(rows) and len(echoes):
        has_left = np.abs(phi[rows, columns, None] - echoes).min(axis=1) <= EXPLAINED_DISTANCE
        cells[rows[has_left], columns[has_left]] = UNKNOWN


def _polar(
    costs: LayeredCostmap, sensor: SE2, slices: tuple[slice, slice]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return distance (h, w), m, and bearing (h, w), rad, of the cells of a window from the sensor."""
    h, w = costs.shape
    y = costs.origin_y + (np.arange(h)[slices[0]] + 0.5) * costs.resolution - sensor.y
    x = costs.origin_x + (np.arange(w)[slices[1]] + 0.5) * costs.resolution - sensor.x
    c, s = math.cos(sensor.yaw), math.sin(sensor.yaw)
    ahead, left = c * x[None, :] + s * y[:, None], c * y[:, None] - s * x[None, :]
    return np.hypot(ahead, left), np.arctan2(left, ahead)


def _updated(
    cells: NDArray[np.uint8],
    phi: NDArray[np.float64],
    theta: NDArray[np.float64],
    distance: float,
    field_of_view: float,
    resolution: float,
) -> NDArray[np.uint8]:
    """Return the costs (h, w) of a window after an echo: the posterior probability of each cell times LETHAL."""
    # weight: falls with the distance (delta) and with the angle from the axis (gamma)
    delta = 1.0 - (1.0 + np.tanh(2.0 * (phi - DECAY_RANGE))) / 2.0
    gamma = np.maximum(1.0 - (theta / (field_of_view / 2.0)) ** 2, 0.0)
    weight = delta * gamma
    likelihood = _likelihood((phi - distance) / resolution, weight)
    # Bayes' rule; a marked cell counts as MARK_PROBABILITY and no more, so that evidence against it can clear it
    prior = np.minimum(np.where(cells == UNKNOWN, PRIOR, cells) / LETHAL, MARK_PROBABILITY)
    occupied, empty = likelihood * prior, (1.0 - likelihood) * (1.0 - prior)
    posterior = occupied / np.maximum(occupied + empty, 1e-9)
    # LETHAL and FREE count in the costmap: a cell is either marked or not, and never free by the ranger alone
    return np.where(posterior >= MARK_PROBABILITY, LETHAL, np.clip(posterior * LETHAL, 1, LETHAL - 1)).astype(
        np.uint8
    )


def _likelihood(offset: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the likelihood of the echo if a cell is occupied; offset: of the cell behind the echo, in cells."""
    # p(z | occupied): low before the echo, high at it, one half behind
    rising = weight * 0.5 * (offset + 2.0) ** 2 + (1.0 - weight) * 0.5
    at_echo = weight * ((1.0 - (0.5 * offset) ** 2) - 0.5) + 0.5
    likelihood = np.where(offset < -2.0, (1.0 - weight) * 0.5, np.where(offset < -1.0, rising, at_echo))
    return np.where(offset >= 1.0, 0.5, likelihood)

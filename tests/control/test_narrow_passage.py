"""When a robot changes to the costs with narrow passages open, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.control.narrow_passage import PATIENCE, NarrowPassage
from chefbot.maths.costs import FREE, INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.local_replanning import collides_within

PERIOD = 0.1
PATH = np.column_stack([np.arange(0.0, 3.0, 0.05), np.zeros(60), np.zeros(60)])


def costs(blocked_from: float, blocked_to: float) -> Costmap:
    """Return costs that are inscribed from one x to another, m."""
    cells = np.full((20, 80), FREE, np.uint8)
    cells[:, round((blocked_from + 1.0) / 0.05) : round((blocked_to + 1.0) / 0.05)] = INSCRIBED
    return Costmap(cells, 0.05, -1.0, -0.5)


CLOSED, OPEN = costs(1.0, 1.2), costs(1.0, 1.0)


class Drive:
    """The choice at one pose after the other; `tries`: how often the narrow costs were made."""

    def __init__(self, narrow: Costmap) -> None:
        self.passage, self.narrow, self.tries = NarrowPassage(_unchanged, collides_within, PERIOD), narrow, 0

    def at(self, x: float, seconds: float = PERIOD) -> Costmap:
        for _ in range(round(seconds / PERIOD)):
            chosen = self.passage.select(PATH, PATH, SE2(x, 0.0, 0.0), CLOSED, self._make)
        return chosen

    def _make(self) -> Costmap:
        self.tries += 1
        return self.narrow


def _unchanged(path: NDArray[np.float64], pose: SE2, costmap: Costmap) -> NDArray[np.float64]:
    return path


def test_far_from_the_passage_the_costs_are_the_usual_ones() -> None:
    drive = Drive(OPEN)
    assert drive.at(0.0, 10.0) is CLOSED
    assert not drive.passage.is_near and drive.tries == 0


def test_before_it_the_robot_waits_and_then_enters() -> None:
    drive = Drive(OPEN)
    assert drive.at(0.7, PATIENCE - 2.0 * PERIOD) is CLOSED
    assert drive.passage.is_near
    assert drive.at(0.7, 0.5) is OPEN


def test_a_robot_without_a_command_tries_too() -> None:
    drive = Drive(OPEN)
    for _ in range(round(PATIENCE / PERIOD) + 1):
        chosen = drive.passage.select(PATH, PATH, SE2(0.0, 0.0, 0.0), OPEN, drive._make, stands=True)
    assert drive.tries > 0 and chosen is OPEN


def test_behind_it_the_costs_are_the_usual_ones_again() -> None:
    drive = Drive(OPEN)
    drive.at(0.7, 2.0)
    assert drive.at(1.1) is OPEN
    assert drive.at(1.3) is CLOSED
    assert not drive.passage.is_near


def test_a_passage_that_is_closed_is_tried_once_in_a_while() -> None:
    drive = Drive(CLOSED)
    assert drive.at(0.7, 10.0) is CLOSED
    assert 5 <= drive.tries <= 10

"""The figures that a run can be judged by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class RunFigure(NamedTuple):
    """The unit of a figure, its meaning, and whether more of it is better (+1), worse (-1), or neither (0)."""

    unit: str
    meaning: str
    better: int = -1


FIGURES: Mapping[str, RunFigure] = {
    "time": RunFigure("s", "simulated time until the task was done or had failed"),
    "path_length": RunFigure("m", "distance that the robot drove", 0),
    "collisions": RunFigure("", "contacts of the robot with anything but the floor"),
    "contact_speed": RunFigure("m/s", "speed of the fastest of these contacts, 0 without any"),
    "near_misses": RunFigure("", "times that the moving robot came nearer than 5 cm to an obstacle"),
    "min_clearance": RunFigure("m", "smallest distance of the moving robot to an obstacle", 1),
    "near_people": RunFigure("s", "time during which it drove towards a person nearer than 0.45 m"),
    "goals_reached": RunFigure("", "share of the goals that the robot truly reached, 0 to 1", 1),
    "recoveries": RunFigure("", "recovery behaviors"),
    "passage_delay": RunFigure("s", "time that the blocked door was free again until the robot was through"),
    "request_delay": RunFigure("s", "time from when the robot was held up until it requested to pass"),
    "given_up": RunFigure("", "1 if the goal was given up within 300 s of being held up, else 0"),
    "doorway_share": RunFigure(
        "", "share of the time that it waited with a goal, each time over 1 s, that it was in a doorway"
    ),
    "map_error_median": RunFigure("m", "median position error on the map that is being made"),
    "map_error_max": RunFigure("m", "largest position error on the map that is being made"),
    "localization_error_median": RunFigure("m", "median position error while localized"),
    "localization_error_max": RunFigure("m", "largest position error while localized"),
    "wrongly_localized": RunFigure(
        "s", "time during which it claims to be localized with an error above 1 m"
    ),
    "explored": RunFigure("", "share in the map of the floor in sight of where the robot can get, 0 to 1", 1),
    "map_precision": RunFigure("", "share of the map's walls that are true, 0 to 1", 1),
    "map_recall": RunFigure("", "share of the true walls in the map, 0 to 1", 1),
    "odometry_drift": RunFigure("m/m", "position error of the odometry by the distance driven"),
    "relation_error": RunFigure("m", "mean error of the relations between true poses"),
}
"""Figures by name; a run has those that its task measures."""

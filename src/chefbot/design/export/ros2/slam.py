"""`slam_toolbox.yaml` for its asynchronous online mapper.

Names: https://github.com/SteveMacenski/slam_toolbox (README, config/mapper_params_online_async.yaml). Values
without a reason are its defaults for cells of 5 cm.
"""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import (
    Explained,
    Tree,
    rounded,
    short,
    with_template,
    yaml_text,
)
from chefbot.design.export.ros2.derived_nav_params import Figures

USUAL_CELL = 0.05
"""Cell size of slam_toolbox's example values, m."""
OVERLAP = 6.0
"""Field of view over the turn between scans: consecutive scans share five sixths of it."""


def slam_toolbox(figures: Figures) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        slam_tree(figures),
        f"slam_toolbox for the robot {figures.robot.name}, written by `chefbot robot export ros2`.",
    )


def slam_tree(figures: Figures) -> Tree:
    """Return the parameters of the node with their reasons."""
    derived: Tree = {**_sensor(figures), **_steps(figures), **_matching(figures)}
    return with_template("slam_toolbox.yaml", {"slam_toolbox": {"ros__parameters": derived}})


def _sensor(figures: Figures) -> Tree:
    scan_sensor = figures.scan_sensor
    return {
        "scan_topic": scan_sensor.topic,
        "min_laser_range": figures.range_min.explained(),
        "max_laser_range": figures.range_max.explained(),
        "resolution": figures.resolution.explained(),
        "transform_timeout": Explained(
            rounded(2.0 / scan_sensor.rate), f"two scans of {short(scan_sensor.rate)} Hz"
        ),
    }


def _steps(figures: Figures) -> Tree:
    """Minimum motion and time between two nodes of the graph."""
    scan_sensor = figures.scan_sensor
    travel, heading = min(2 * figures.radius.number, 0.5), min(scan_sensor.angle / OVERLAP, 0.5)
    soonest = min(travel / figures.speed.number, heading / figures.turn.number)
    return {
        "minimum_travel_distance": Explained(rounded(travel), "the robot's own diameter, 0.5 at most"),
        "minimum_travel_heading": Explained(
            rounded(heading),
            f"a sixth of the field of view of {short(math.degrees(scan_sensor.angle))} degrees, so that scans"
            " overlap; 0.5 at most",
        ),
        "minimum_time_interval": Explained(
            rounded(max(1.0 / scan_sensor.rate, soonest / 2)),
            f"half of the {short(soonest)} s of driving or turning that far, the period of the scans at least",
        ),
    }


def _matching(figures: Figures) -> Tree:
    """Search windows of as many cells as in the example, so at equal cost; a smear is ten cells at most (Karto)."""
    scale = figures.resolution.number / USUAL_CELL

    def cells(usual: float) -> Explained:
        return Explained(
            rounded(usual * scale), f"{usual:g} for cells of {USUAL_CELL:g}, scaled by {scale:g}"
        )

    return {
        "correlation_search_space_dimension": cells(0.5),
        "correlation_search_space_resolution": cells(0.01),
        "correlation_search_space_smear_deviation": cells(0.1),
        "loop_search_space_dimension": cells(8.0),
        "loop_search_space_resolution": cells(0.05),
        "loop_search_space_smear_deviation": cells(0.03),
    }

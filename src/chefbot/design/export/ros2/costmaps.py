"""The two costmaps of Nav2: size, footprint, inflation and obstacle sources."""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Explained, Tree, rounded, short
from chefbot.design.export.ros2.derived_nav_params import Figures

EXTRA_CLEARING_RANGE = 0.5
"""Metres by which the clearing range exceeds the marking range, so that marks at its end are cleared."""


def local_costmap(figures: Figures) -> Tree:
    """Return the costmap that moves with the robot in odom."""
    side = Explained(math.ceil(figures.local_costmap_side.number), figures.local_costmap_side.derivation)
    hz = min(figures.scan_sensor.rate, figures.frequency.number)
    return {
        "update_frequency": Explained(
            rounded(hz),
            f"the rate of the scan, {short(figures.scan_sensor.rate)} Hz, the controller frequency at most",
        ),
        "width": side,
        "height": Explained(math.ceil(figures.local_costmap_side.number), "as width"),
        **_common(figures),
    }


def global_costmap(figures: Figures) -> Tree:
    """Return the costmap of the map, with current obstacles and inflation."""
    return _common(figures)


def _common(figures: Figures) -> Tree:
    cell = figures.resolution.number
    return {
        "resolution": figures.resolution.explained(),
        "robot_radius": figures.radius.explained(),
        **_footprint(figures),
        "footprint_padding": Explained(rounded(cell / 5), "a fifth of a cell"),
        "obstacle_layer": _obstacles(figures),
        "inflation_layer": {
            "inflation_radius": figures.inflation.explained(),
            "cost_scaling_factor": figures.cost_scaling.explained(),
        },
    }


def _footprint(figures: Figures) -> Tree:
    """Return the polygon of a robot that is not a disc, which Nav2 then uses instead of the radius."""
    points = figures.polygon
    return {"footprint": Explained(points, "plates and wheels, in base_link")} if points else {}


def _obstacles(figures: Figures) -> Tree:
    """The scan, and the camera's scan if the robot maps with a lidar."""
    sources: dict[str, Tree] = {
        "scan": _source(figures, figures.scan_sensor.topic, figures.scan_sensor.range_min)
    }
    camera = figures.robot.sensors.depth_camera
    if camera is not None and figures.robot.sensors.lidar is not None:
        sources["depth_scan"] = _source(
            figures, "/depth_scan", camera.range_min, camera.range_with_noise(figures.resolution.number)
        )
    return {
        "observation_sources": " ".join(sources),
        **sources,
    }


def _source(figures: Figures, topic: str, range_min: float, useful: float = math.inf) -> Tree:
    mark = min(figures.obstacle_range.number, useful)
    clear = min(
        mark + EXTRA_CLEARING_RANGE,
        figures.scan_sensor.far if useful == math.inf else useful + EXTRA_CLEARING_RANGE,
    )
    return {
        "topic": topic,
        "data_type": "LaserScan",
        "marking": True,
        "clearing": True,
        "inf_is_valid": Explained(True, "a beam without a return clears its ray"),
        "obstacle_min_range": Explained(rounded(range_min), "the sensor's minimum range"),
        "obstacle_max_range": Explained(rounded(mark), figures.obstacle_range.derivation),
        "raytrace_min_range": 0.0,
        "raytrace_max_range": Explained(
            rounded(clear),
            f"{EXTRA_CLEARING_RANGE:g} m more than obstacle_max_range, the sensor's range at most",
        ),
        "max_obstacle_height": figures.obstacle_height.explained(),
        "min_obstacle_height": 0.0,
    }

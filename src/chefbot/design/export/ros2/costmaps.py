"""The two costmaps of Nav2: size, footprint, inflation and obstacle sources."""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Because, Tree, rounded, short
from chefbot.design.export.ros2.derived_nav_params import Figures

CLEAR_BEYOND = 0.5
"""Metres that beams clear further than they mark, or what was marked at the end of its range would stay."""


def local_costmap(figures: Figures) -> Tree:
    """Return the costmap that moves with the robot in odom."""
    side = Because(math.ceil(figures.window.number), figures.window.how)
    hz = min(figures.sight.rate, figures.frequency.number)
    return {
        "update_frequency": Because(
            rounded(hz),
            f"a scan brings news {short(figures.sight.rate)} times a second; no faster than the controller",
        ),
        "publish_frequency": 2.0,
        "global_frame": "odom",
        "robot_base_frame": "base_link",
        "rolling_window": True,
        "width": side,
        "height": Because(math.ceil(figures.window.number), "as width"),
        "track_unknown_space": False,
        **_common(figures, ["obstacle_layer", "inflation_layer"]),
    }


def global_costmap(figures: Figures) -> Tree:
    """Return the costmap of the map, with current obstacles and inflation."""
    return {
        "update_frequency": 1.0,
        "publish_frequency": 1.0,
        "global_frame": "map",
        "robot_base_frame": "base_link",
        "track_unknown_space": True,
        "static_layer": {"plugin": "nav2_costmap_2d::StaticLayer", "map_subscribe_transient_local": True},
        **_common(figures, ["static_layer", "obstacle_layer", "inflation_layer"]),
    }


def _common(figures: Figures, layers: list[str]) -> Tree:
    cell = figures.resolution.number
    return {
        "resolution": figures.resolution.because(),
        "robot_radius": figures.radius.because(),
        "footprint_padding": Because(rounded(cell / 5), "a fifth of a cell"),
        "plugins": list(layers),
        "obstacle_layer": _obstacles(figures),
        "inflation_layer": {
            "plugin": "nav2_costmap_2d::InflationLayer",
            "inflation_radius": figures.inflation.because(),
            "cost_scaling_factor": figures.cost_scaling.because(),
        },
        "always_send_full_costmap": True,
    }


def _obstacles(figures: Figures) -> Tree:
    """One scan, and the camera's too where the robot maps with a lidar."""
    sources: dict[str, Tree] = {"scan": _source(figures, figures.sight.topic, figures.sight.range_min)}
    camera = figures.robot.sensors.depth_camera
    if camera is not None and figures.robot.sensors.lidar is not None:
        sources["depth_scan"] = _source(
            figures, "/depth_scan", camera.range_min, camera.range_with_noise(figures.resolution.number)
        )
    return {
        "plugin": "nav2_costmap_2d::ObstacleLayer",
        "enabled": True,
        "observation_sources": " ".join(sources),
        **sources,
    }


def _source(figures: Figures, topic: str, least: float, useful: float = math.inf) -> Tree:
    mark = min(figures.marking.number, useful)
    clear = min(mark + CLEAR_BEYOND, figures.sight.far if useful == math.inf else useful + CLEAR_BEYOND)
    return {
        "topic": topic,
        "data_type": "LaserScan",
        "marking": True,
        "clearing": True,
        "inf_is_valid": Because(True, "a beam that meets nothing clears its way"),
        "obstacle_min_range": Because(rounded(least), "the sensor's least range"),
        "obstacle_max_range": Because(rounded(mark), figures.marking.how),
        "raytrace_min_range": 0.0,
        "raytrace_max_range": Because(
            rounded(clear), f"{CLEAR_BEYOND:g} m further than it marks, as far as the sensor sees"
        ),
        "max_obstacle_height": figures.top.because(),
        "min_obstacle_height": 0.0,
    }

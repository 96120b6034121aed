"""`slam_toolbox.yaml` for its asynchronous online mapper.

Names: https://github.com/SteveMacenski/slam_toolbox (README, config/mapper_params_online_async.yaml). Values
without a reason are its defaults for cells of 5 cm.
"""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Because, Tree, rounded, short, yaml_text
from chefbot.design.export.ros2.derived_nav_params import Doubt, Figures
from chefbot.robot.spec import Robot

USUAL_CELL = 0.05
"""m; what slam_toolbox's own values are for."""
OVERLAP = 6.0
"""Scans share five sixths of what the sensor sees at once."""


def slam_toolbox(robot: Robot, doubt: Doubt) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        slam_tree(robot, doubt), f"slam_toolbox for the robot {robot.name}, written by `chefbot ros2`."
    )


def slam_tree(robot: Robot, doubt: Doubt) -> Tree:
    """Return the parameters of the node with their reasons."""
    figures = Figures(robot, doubt)
    return {
        "slam_toolbox": {
            "ros__parameters": {**_solver(), **_sensor(figures), **_steps(figures), **_matching(figures)}
        }
    }


def _solver() -> Tree:
    return {
        "solver_plugin": "solver_plugins::CeresSolver",
        "ceres_linear_solver": "SPARSE_NORMAL_CHOLESKY",
        "ceres_preconditioner": "SCHUR_JACOBI",
        "ceres_trust_strategy": "LEVENBERG_MARQUARDT",
        "ceres_dogleg_type": "TRADITIONAL_DOGLEG",
        "ceres_loss_function": "None",
        "odom_frame": "odom",
        "map_frame": "map",
        "base_frame": "base_footprint",
        "mode": "mapping",
        "debug_logging": False,
        "stack_size_to_use": 40000000,
        "enable_interactive_mode": True,
        "use_map_saver": True,
    }


def _sensor(figures: Figures) -> Tree:
    sight, cell = figures.sight, figures.resolution.number
    return {
        "scan_topic": sight.topic,
        "min_laser_range": Because(rounded(sight.range_min), f"the {sight.sensor}'s least range"),
        "max_laser_range": Because(
            rounded(sight.range_max),
            f"of the {sight.sensor}'s {short(sight.far)} m those where its noise is at most a cell:"
            f" {short(sight.noise)} m of {short(cell)} m",
        ),
        "resolution": figures.resolution.because(),
        "throttle_scans": 1,
        "transform_timeout": Because(rounded(2.0 / sight.rate), f"two scans of {short(sight.rate)} Hz"),
        "transform_publish_period": 0.02,
        "tf_buffer_duration": 30.0,
        "map_update_interval": 2.0,
    }


def _steps(figures: Figures) -> Tree:
    """When a scan is worth a node of the graph."""
    sight = figures.sight
    travel, heading = min(2 * figures.radius.number, 0.5), min(sight.angle / OVERLAP, 0.5)
    soonest = min(travel / figures.speed.number, heading / figures.turn.number)
    return {
        "minimum_travel_distance": Because(rounded(travel), "the robot's own diameter, 0.5 at most"),
        "minimum_travel_heading": Because(
            rounded(heading),
            f"a sixth of the {short(math.degrees(sight.angle))} degrees that it sees, so that scans overlap; 0.5 at"
            " most",
        ),
        "minimum_time_interval": Because(
            rounded(max(1.0 / sight.rate, soonest / 2)),
            f"half of the {short(soonest)} s in which it can drive or turn so far, or the time from scan to scan",
        ),
    }


def _matching(figures: Figures) -> Tree:
    """Searches of as many cells as usual, hence as dear; a smear is at most ten cells of its search (Karto)."""
    scale = figures.resolution.number / USUAL_CELL

    def cells(usual: float) -> Because:
        return Because(rounded(usual * scale), f"{usual:g} for cells of {USUAL_CELL:g}; times {scale:g} here")

    return {
        "use_scan_matching": True,
        "use_scan_barycenter": True,
        "scan_buffer_size": 10,
        "scan_buffer_maximum_scan_distance": 10.0,
        "link_match_minimum_response_fine": 0.1,
        "link_scan_maximum_distance": 1.5,
        "do_loop_closing": True,
        "loop_search_maximum_distance": 3.0,
        "loop_match_minimum_chain_size": 10,
        "loop_match_maximum_variance_coarse": 3.0,
        "loop_match_minimum_response_coarse": 0.35,
        "loop_match_minimum_response_fine": 0.45,
        "correlation_search_space_dimension": cells(0.5),
        "correlation_search_space_resolution": cells(0.01),
        "correlation_search_space_smear_deviation": cells(0.1),
        "loop_search_space_dimension": cells(8.0),
        "loop_search_space_resolution": cells(0.05),
        "loop_search_space_smear_deviation": cells(0.03),
        "distance_variance_penalty": 0.5,
        "angle_variance_penalty": 1.0,
        "fine_search_angle_offset": 0.00349,
        "coarse_search_angle_offset": 0.349,
        "coarse_angle_resolution": 0.0349,
        "minimum_angle_penalty": 0.9,
        "minimum_distance_penalty": 0.5,
        "use_response_expansion": True,
    }

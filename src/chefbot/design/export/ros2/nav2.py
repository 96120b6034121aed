"""`nav2_params.yaml`: every server of Nav2 that the launch files start, derived from the robot.

Names and meanings: https://docs.nav2.org/configuration/index.html (Jazzy and Kilted). A value without a reason is
Nav2's own example value and does not depend on the robot.
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
from chefbot.design.export.ros2.controllers import controller_server
from chefbot.design.export.ros2.costmaps import global_costmap, local_costmap
from chefbot.design.export.ros2.derived_nav_params import Figures
from chefbot.design.export.ros2.odometry_noise import alphas
from chefbot.robot.motion_limits import max_wheel_speed

UPDATE_TURN = 0.1
"""Minimum turn between updates, rad; as in chefbot's particle filter."""
CRAWL = 0.2
"""Share of the maximum turn rate below which the motors' stiction prevents a spin."""
TWIST = Explained(
    False,
    "chefbot's base and Gazebo's bridge subscribe to geometry_msgs/Twist; Kilted's default is TwistStamped",
)


def nav2_params(figures: Figures) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        nav2_tree(figures),
        f"Nav2 for the robot {figures.robot.name}, written by `chefbot robot export ros2`; "
        "parameter names of Jazzy and Kilted.\n"
        "Values that depend on the robot have a reason; change the robot file and export again, or change them here.",
    )


def nav2_tree(figures: Figures) -> Tree:
    """Return node to parameters with their reasons."""
    nodes: dict[str, Tree] = {
        "amcl": amcl(figures),
        "controller_server": {**controller_server(figures), "enable_stamped_cmd_vel": TWIST},
        "planner_server": planner_server(figures),
        "behavior_server": behavior_server(figures),
        "velocity_smoother": velocity_smoother(figures),
        "collision_monitor": collision_monitor(figures),
    }
    tree: dict[str, Tree] = {name: {"ros__parameters": params} for name, params in nodes.items()}
    tree["local_costmap"] = {"local_costmap": {"ros__parameters": local_costmap(figures)}}
    tree["global_costmap"] = {"global_costmap": {"ros__parameters": global_costmap(figures)}}
    return with_template("nav2_params.yaml", tree)


def amcl(figures: Figures) -> Tree:
    """Return localization; sensor ranges, map errors and odometry errors are the robot's."""
    travel = 2 * figures.resolution.number
    return {
        "scan_topic": figures.scan_sensor.topic,
        "robot_model_type": Explained("nav2_amcl::DifferentialMotionModel", "two driven wheels"),
        **alphas(figures, travel, UPDATE_TURN),
        "update_min_d": Explained(
            rounded(travel), "two cells: smaller motions do not change the distances to the map"
        ),
        "update_min_a": Explained(UPDATE_TURN, "as in chefbot's particle filter"),
        **_laser_model(figures),
        "recovery_alpha_slow": Explained(0.001, "not 0, to recover from a kidnapped robot"),
    }


def _laser_model(figures: Figures) -> Tree:
    cell, noise = figures.resolution.number, figures.scan_sensor.noise
    return {
        "laser_min_range": figures.range_min.explained(),
        "laser_max_range": figures.range_max.explained(),
        "sigma_hit": Explained(
            rounded(math.hypot(2 * cell, noise)),
            f"map error of two cells, {short(2 * cell)}, and noise {short(noise)} m",
        ),
    }


def planner_server(figures: Figures) -> Tree:
    """Return NavFn; a round robot that turns on the spot needs no kinematic planner."""
    return {
        "expected_planner_frequency": Explained(1.0, "rate of the behavior tree's replanning"),
        "GridBased": {
            "plugin": Explained(
                "nav2_navfn_planner::NavfnPlanner",
                "a circular robot that turns on the spot needs x and y only",
            ),
            "tolerance": figures.radius.explained("maximum distance of an alternative to a blocked goal"),
        },
    }


def behavior_server(figures: Figures) -> Tree:
    """Return the recovery behaviors within the robot's limits."""
    rear = figures.scan_sensor.covers_rear
    blind = "" if rear else "; no sensor covers the rear, only the costmap's memory"
    return {
        "cycle_frequency": figures.frequency.explained(),
        "simulate_ahead_time": figures.horizon.explained(f"collision check ahead{blind}"),
        "max_rotational_vel": figures.turn.limit(),
        "min_rotational_vel": figures.turn.times(CRAWL, f"{CRAWL:g} of the maximum turn rate"),
        "rotational_acc_lim": figures.turn_acceleration.limit(),
        "enable_stamped_cmd_vel": TWIST,
    }


def velocity_smoother(figures: Figures) -> Tree:
    """Return the robot's acceleration limits, which chefbot's base applies as well."""
    v, w = figures.speed.number, figures.turn.number
    a, b = figures.acceleration.number, figures.turn_acceleration.number
    back = v if figures.scan_sensor.covers_rear else v / 2
    robot = figures.robot
    wheel = v + w * robot.wheels.separation / 2
    return {
        "smoothing_frequency": figures.frequency.explained("same as the controller"),
        "scale_velocities": Explained(True, "a limited twist keeps its curvature"),
        "max_velocity": Explained(
            [v, 0.0, w],
            f"drive.max_speed and max_turn, limited by the motors. Both at once are {short(wheel)} m/s at a wheel,"
            f" whose maximum is {short(max_wheel_speed(robot))}: the base scales such commands",
        ),
        "min_velocity": Explained(
            [-back, 0.0, -w],
            "the same in reverse" if back == v else "half of it in reverse, which no sensor covers",
        ),
        "max_accel": Explained(
            [a, 0.0, b], f"{figures.acceleration.derivation}; {figures.turn_acceleration.derivation}"
        ),
        "max_decel": Explained(
            [-figures.deceleration.number, 0.0, -figures.turn_deceleration.number],
            f"{figures.deceleration.derivation}; {figures.turn_deceleration.derivation}",
        ),
        "velocity_timeout": Explained(
            rounded(4.0 / figures.frequency.number), "four missed commands: 4 / controller_frequency"
        ),
        "enable_stamped_cmd_vel": TWIST,
    }


def collision_monitor(figures: Figures) -> Tree:
    """Return the monitor that slows down before obstacles on the commanded path."""
    scan_sensor = figures.scan_sensor
    return {
        "source_timeout": Explained(
            rounded(max(0.3, 3.0 / scan_sensor.rate)),
            f"three scans of {short(scan_sensor.rate)} Hz missed: stop",
        ),
        "FootprintApproach": _approach(figures),
        "scan": {"topic": scan_sensor.topic},
        "enable_stamped_cmd_vel": TWIST,
    }


def _approach(figures: Figures) -> Tree:
    v, a, t = figures.speed.number, figures.acceleration.number, figures.latency.number
    return {
        **_shape(figures),
        "radius": figures.radius.explained(),
        "time_before_collision": Explained(
            rounded(t + v / a), f"latency {short(t)} + stop v/a = {short(v)} / {short(a)}"
        ),
        "simulation_time_step": Explained(
            rounded(figures.resolution.number / v / 2), "half a cell at full speed"
        ),
    }


def _shape(figures: Figures) -> Tree:
    if not figures.polygon:
        return {"type": Explained("circle", "circular footprint")}
    points = Explained(figures.polygon, "plates and wheels, in base_link")
    return {"type": Explained("polygon", "rectangular footprint"), "points": points}

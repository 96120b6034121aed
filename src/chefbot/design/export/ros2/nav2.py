"""`nav2_params.yaml`: every server of Nav2 that the launch files start, derived from the robot.

Names and meanings: https://docs.nav2.org/configuration/index.html (Jazzy and Kilted). A value without a reason is
Nav2's own example value and does not depend on the robot.
"""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Explained, Tree, rounded, short, yaml_text
from chefbot.design.export.ros2.controllers import controller_server
from chefbot.design.export.ros2.costmaps import global_costmap, local_costmap
from chefbot.design.export.ros2.derived_nav_params import Figures, OdometryErrors
from chefbot.design.export.ros2.odometry_noise import alphas
from chefbot.robot.motion_limits import max_wheel_speed
from chefbot.robot.spec import Robot

UPDATE_TURN = 0.1
"""Minimum turn between updates, rad; as in chefbot's particle filter."""
CRAWL = 0.2
"""Share of the maximum turn rate below which the motors' stiction prevents a spin."""
TWIST = Explained(
    False,
    "chefbot's base and Gazebo's bridge subscribe to geometry_msgs/Twist; Kilted's default is TwistStamped",
)
SEND_TO = "cmd_vel_nav"
"""Topic of the base for navigation commands; cmd_vel_teleop has priority over it."""


def nav2_params(robot: Robot, odometry_errors: OdometryErrors) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        nav2_tree(robot, odometry_errors),
        f"Nav2 for the robot {robot.name}, written by `chefbot ros2`; parameter names of Jazzy and Kilted.\n"
        "Values that depend on the robot have a reason; change the robot file and export again, or change them here.",
    )


def nav2_tree(robot: Robot, odometry_errors: OdometryErrors) -> Tree:
    """Return node to parameters with their reasons."""
    figures = Figures(robot, odometry_errors)
    nodes: dict[str, Tree] = {
        "amcl": amcl(figures),
        "bt_navigator": bt_navigator(),
        "controller_server": {**controller_server(figures), "enable_stamped_cmd_vel": TWIST},
        "planner_server": planner_server(figures),
        "smoother_server": smoother_server(),
        "behavior_server": behavior_server(figures),
        "velocity_smoother": velocity_smoother(figures),
        "collision_monitor": collision_monitor(figures),
        "waypoint_follower": waypoint_follower(),
    }
    tree: dict[str, Tree] = {name: {"ros__parameters": params} for name, params in nodes.items()}
    tree["local_costmap"] = {"local_costmap": {"ros__parameters": local_costmap(figures)}}
    tree["global_costmap"] = {"global_costmap": {"ros__parameters": global_costmap(figures)}}
    return tree


def amcl(figures: Figures) -> Tree:
    """Return localization; sensor ranges, map errors and odometry errors are the robot's."""
    scan_sensor, cell = figures.scan_sensor, figures.resolution.number
    travel = 2 * cell
    blur = math.hypot(2 * cell, scan_sensor.noise)
    return {
        "base_frame_id": "base_footprint",
        "odom_frame_id": "odom",
        "global_frame_id": "map",
        "scan_topic": scan_sensor.topic,
        "robot_model_type": Explained("nav2_amcl::DifferentialMotionModel", "two driven wheels"),
        **alphas(figures, travel, UPDATE_TURN),
        "update_min_d": Explained(
            rounded(travel), "two cells: smaller motions do not change the distances to the map"
        ),
        "update_min_a": UPDATE_TURN,
        "laser_model_type": "likelihood_field",
        "laser_min_range": Explained(
            rounded(scan_sensor.range_min), f"the {scan_sensor.sensor}'s minimum range"
        ),
        "laser_max_range": Explained(
            rounded(scan_sensor.range_max),
            f"range of the {scan_sensor.sensor}, {short(scan_sensor.far)} m, up to a noise of a cell:"
            f" {short(scan_sensor.noise)} m of {short(cell)} m",
        ),
        "sigma_hit": Explained(
            rounded(blur),
            f"map error of two cells, {short(2 * cell)}, and noise {short(scan_sensor.noise)} m",
        ),
        "laser_likelihood_max_dist": 2.0,
        "max_beams": 60,
        "z_hit": 0.5,
        "z_max": 0.05,
        "z_rand": 0.5,
        "z_short": 0.05,
        "lambda_short": 0.1,
        "do_beamskip": False,
        "min_particles": 500,
        "max_particles": 2000,
        "pf_err": 0.05,
        "pf_z": 0.99,
        "recovery_alpha_slow": Explained(0.001, "not 0, to recover from a kidnapped robot"),
        "recovery_alpha_fast": 0.1,
        "resample_interval": 1,
        "save_pose_rate": 0.5,
        "tf_broadcast": True,
        "transform_tolerance": 1.0,
    }


def bt_navigator() -> Tree:
    """Return the navigator with the behavior trees of the distribution."""
    return {
        "global_frame": "map",
        "robot_base_frame": "base_link",
        "odom_topic": "/odom",
        "bt_loop_duration": 10,
        "default_server_timeout": 20,
        "wait_for_service_timeout": 1000,
        "navigators": ["navigate_to_pose", "navigate_through_poses"],
        "navigate_to_pose": {"plugin": "nav2_bt_navigator::NavigateToPoseNavigator"},
        "navigate_through_poses": {"plugin": "nav2_bt_navigator::NavigateThroughPosesNavigator"},
    }


def planner_server(figures: Figures) -> Tree:
    """Return NavFn; a round robot that turns on the spot needs no kinematic planner."""
    return {
        "expected_planner_frequency": Explained(1.0, "rate of the behavior tree's replanning"),
        "planner_plugins": ["GridBased"],
        "GridBased": {
            "plugin": Explained(
                "nav2_navfn_planner::NavfnPlanner",
                "a circular robot that turns on the spot needs x and y only",
            ),
            "tolerance": figures.radius.explained("maximum distance of an alternative to a blocked goal"),
            "use_astar": True,
            "allow_unknown": True,
        },
    }


def smoother_server() -> Tree:
    """Return the path smoother with Nav2's defaults."""
    return {
        "smoother_plugins": ["simple_smoother"],
        "simple_smoother": {
            "plugin": "nav2_smoother::SimpleSmoother",
            "tolerance": 1.0e-10,
            "max_its": 1000,
            "do_refinement": True,
        },
    }


def behavior_server(figures: Figures) -> Tree:
    """Return the recovery behaviors within the robot's limits."""
    blind = (
        ""
        if figures.scan_sensor.angle > math.pi
        else "; no sensor covers the rear, only the costmap's memory"
    )
    plugins = {
        "spin": "nav2_behaviors::Spin",
        "backup": "nav2_behaviors::BackUp",
        "drive_on_heading": "nav2_behaviors::DriveOnHeading",
        "assisted_teleop": "nav2_behaviors::AssistedTeleop",
        "wait": "nav2_behaviors::Wait",
    }
    return {
        "local_costmap_topic": "local_costmap/costmap_raw",
        "global_costmap_topic": "global_costmap/costmap_raw",
        "local_footprint_topic": "local_costmap/published_footprint",
        "global_footprint_topic": "global_costmap/published_footprint",
        "cycle_frequency": figures.frequency.explained(),
        "behavior_plugins": list(plugins),
        **{name: {"plugin": plugin} for name, plugin in plugins.items()},
        "local_frame": "odom",
        "global_frame": "map",
        "robot_base_frame": "base_link",
        "transform_tolerance": 0.1,
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
    back = v if figures.scan_sensor.angle > math.pi else v / 2
    robot = figures.robot
    wheel = v + w * robot.wheels.separation / 2
    return {
        "smoothing_frequency": figures.frequency.explained("same as the controller"),
        "scale_velocities": Explained(True, "a limited twist keeps its curvature"),
        "feedback": "OPEN_LOOP",
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
        "max_decel": Explained([-a, 0.0, -b], "decelerates as it accelerates"),
        "deadband_velocity": [0.0, 0.0, 0.0],
        "velocity_timeout": Explained(
            rounded(4.0 / figures.frequency.number), "four missed commands: 4 / controller_frequency"
        ),
        "odom_topic": "/odom",
        "odom_duration": 0.1,
        "enable_stamped_cmd_vel": TWIST,
    }


def collision_monitor(figures: Figures) -> Tree:
    """Return the monitor that slows down before obstacles on the commanded path."""
    v, a, t = figures.speed.number, figures.acceleration.number, figures.latency.number
    scan_sensor = figures.scan_sensor
    return {
        "base_frame_id": "base_footprint",
        "odom_frame_id": "odom",
        "cmd_vel_in_topic": "cmd_vel_smoothed",
        "cmd_vel_out_topic": SEND_TO,
        "state_topic": "collision_monitor_state",
        "transform_tolerance": 0.2,
        "source_timeout": Explained(
            rounded(max(0.3, 3.0 / scan_sensor.rate)),
            f"three scans of {short(scan_sensor.rate)} Hz missed: stop",
        ),
        "base_shift_correction": True,
        "stop_pub_timeout": 2.0,
        "polygons": ["FootprintApproach"],
        "FootprintApproach": {
            "type": Explained("circle", "circular footprint"),
            "radius": figures.radius.explained(),
            "action_type": "approach",
            "time_before_collision": Explained(
                rounded(t + v / a), f"latency {short(t)} + stop v/a = {short(v)} / {short(a)}"
            ),
            "simulation_time_step": Explained(
                rounded(figures.resolution.number / v / 2), "half a cell at full speed"
            ),
            "min_points": 4,
            "visualize": False,
            "enabled": True,
        },
        "observation_sources": ["scan"],
        "scan": {"type": "scan", "topic": scan_sensor.topic, "enabled": True},
        "enable_stamped_cmd_vel": TWIST,
    }


def waypoint_follower() -> Tree:
    """Return the waypoint follower with Nav2's defaults."""
    return {
        "loop_rate": 20,
        "stop_on_failure": False,
        "waypoint_task_executor_plugin": "wait_at_waypoint",
        "wait_at_waypoint": {
            "plugin": "nav2_waypoint_follower::WaitAtWaypoint",
            "enabled": True,
            "waypoint_pause_duration": 200,
        },
    }

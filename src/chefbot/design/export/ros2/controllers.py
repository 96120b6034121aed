"""Nav2's controller server: MPPI by default, DWB for small computers, both within the robot's limits.

MPPI's distances are Nav2's example values over what its example robot reaches in its horizon (0.5 m/s for 56 steps
of 0.05 s: 1.4 m), times what this robot reaches: https://docs.nav2.org/configuration/packages/configuring-mppic.html
"""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Explained, Tree, rounded, short
from chefbot.design.export.ros2.derived_nav_params import Figures

EXAMPLE_SPEED, EXAMPLE_TURN, EXAMPLE_AHEAD, EXAMPLE_CELL = 0.5, 1.9, 1.4, 0.05
"""Nav2's example robot: m/s, rad/s, m, m."""
MOVEMENT_TIMEOUT = 8.0
"""Seconds without progress, as in chefbot's progress checker."""
CRAWL = 0.02
"""Share of the full speed above which the robot never counts as standing."""
STOPPED = 0.1
"""Share of the full speed that counts as standing."""


def controller_server(figures: Figures) -> Tree:
    """Return goal checker, progress checker and the two controllers of the topic controller_selector."""
    robot = figures.robot
    tick = robot.metres_per_tick * robot.sensors.imu.rate
    slowest = min(tick, CRAWL * figures.speed.number)
    turning = min(2 * tick / robot.wheels.separation, CRAWL * figures.turn.number)
    return {
        "controller_frequency": figures.frequency.explained(),
        "min_x_velocity_threshold": Explained(
            rounded(slowest),
            f"one encoder tick, {short(1000 * robot.metres_per_tick)} mm, per odometry message of"
            f" {short(robot.sensors.imu.rate)} Hz; a lower speed may be standstill; {CRAWL:g} of full speed at most",
        ),
        "min_y_velocity_threshold": 0.5,
        "min_theta_velocity_threshold": Explained(
            rounded(turning),
            f"both wheels at that speed: 2 x speed / separation; {CRAWL:g} of the full turn rate at most",
        ),
        "failure_tolerance": 0.3,
        "progress_checker_plugins": ["progress_checker"],
        "goal_checker_plugins": ["general_goal_checker"],
        "controller_plugins": ["FollowPath", "DWB"],
        "progress_checker": {
            "plugin": Explained(
                "nav2_controller::PoseProgressChecker", "a turn on the spot counts as progress"
            ),
            "required_movement_radius": figures.radius.explained(),
            "required_movement_angle": 0.5,
            "movement_time_allowance": MOVEMENT_TIMEOUT,
        },
        "general_goal_checker": {
            "plugin": "nav2_controller::SimpleGoalChecker",
            "stateful": True,
            "xy_goal_tolerance": figures.goal_tolerance.explained(),
            "yaw_goal_tolerance": figures.goal_yaw_tolerance.explained(),
        },
        "FollowPath": mppi(figures),
        "DWB": dwb(figures),
    }


def mppi(figures: Figures) -> Tree:
    """Return the parameters of model predictive path integral control."""
    v, w, hz = figures.speed, figures.turn, figures.frequency.number
    steps = math.ceil(figures.horizon.number * hz)
    rear = figures.scan_sensor.angle > math.pi
    return {
        "plugin": "nav2_mppi_controller::MPPIController",
        "motion_model": Explained("DiffDrive", "two driven wheels"),
        "model_dt": Explained(
            1.0 / hz, "exactly 1 / controller_frequency, otherwise MPPI does not shift its control sequence"
        ),
        "time_steps": Explained(steps, f"horizon x frequency; {figures.horizon.derivation}"),
        "batch_size": 1000,
        "iteration_count": 1,
        "vx_max": v.limit(),
        "vx_min": Explained(-v.number / 2, "half of it in reverse: the scan covers the rear")
        if rear
        else Explained(0.0, f"no reverse: the {figures.scan_sensor.sensor} does not cover the rear"),
        "wz_max": w.limit(),
        "ax_max": figures.acceleration.limit(),
        "ax_min": figures.acceleration.limit("decelerates as it accelerates", -1.0),
        "az_max": figures.turn_acceleration.limit(),
        "vx_std": v.times(0.2 / EXAMPLE_SPEED, "0.2 at 0.5 m/s in Nav2's example: the same share"),
        "wz_std": w.times(0.4 / EXAMPLE_TURN, "0.4 at 1.9 rad/s in Nav2's example: the same share"),
        "temperature": 0.3,
        "gamma": 0.015,
        "prune_distance": figures.lookahead.times(
            1.7 / EXAMPLE_AHEAD, f"1.7 / 1.4 of {figures.lookahead.derivation}"
        ),
        "transform_tolerance": 0.1,
        "visualize": False,
        "regenerate_noises": True,
        **mppi_critics(figures),
    }


def mppi_critics(figures: Figures) -> Tree:
    """Return MPPI's critics; distances and numbers of path points scale with the distance driven in the horizon."""

    def metres(example: float) -> Explained:
        ahead = figures.lookahead
        reason = (
            f"{example:g} x {short(ahead.number)} / {EXAMPLE_AHEAD:g}: scaled with the look-ahead distance"
        )
        return ahead.times(example / EXAMPLE_AHEAD, reason)

    def points(example: int) -> Explained:
        cells = figures.lookahead.number / figures.resolution.number
        of_example = EXAMPLE_AHEAD / EXAMPLE_CELL
        number = max(1, round(example * cells / of_example))
        return Explained(
            number,
            f"{example} of {of_example:g} cells of look-ahead in the example, scaled to {short(cells)} cells",
        )

    def critic(weight: float, **more: Explained | float | bool) -> Tree:
        return {"enabled": True, "cost_power": 1, "cost_weight": weight, **more}

    critics: dict[str, Tree] = {
        "ConstraintCritic": critic(4.0),
        "CostCritic": critic(
            3.81,
            near_collision_cost=253,
            critical_cost=300.0,
            consider_footprint=Explained(False, "circular footprint"),
            collision_cost=1000000.0,
            near_goal_distance=metres(1.0),
            trajectory_point_step=2,
        ),
        "GoalCritic": critic(5.0, threshold_to_consider=figures.lookahead.explained()),
        "GoalAngleCritic": critic(3.0, threshold_to_consider=metres(0.5)),
        "PathAlignCritic": critic(
            14.0,
            max_path_occupancy_ratio=0.05,
            trajectory_point_step=4,
            threshold_to_consider=metres(0.5),
            offset_from_furthest=points(20),
            use_path_orientations=False,
        ),
        "PathFollowCritic": critic(
            5.0, offset_from_furthest=points(5), threshold_to_consider=figures.lookahead.explained()
        ),
        "PathAngleCritic": critic(
            2.0,
            offset_from_furthest=points(4),
            threshold_to_consider=metres(0.5),
            max_angle_to_furthest=1.0,
            mode=0,
        ),
        "PreferForwardCritic": critic(5.0, threshold_to_consider=metres(0.5)),
    }
    return {"critics": list(critics), **critics}


def dwb(figures: Figures) -> Tree:
    """Return the parameters of DWB; it keeps one twist for the entire look-ahead, so half of MPPI's horizon."""
    v, w, a, b = figures.speed, figures.turn, figures.acceleration, figures.turn_acceleration
    sim_time = min(max(figures.horizon.number / 2, 1.0), 2.0)
    point = figures.radius.times(2.0 / 3.0, "two thirds of the radius ahead of the centre")
    return {
        "plugin": "dwb_core::DWBLocalPlanner",
        "min_vel_x": 0.0,
        "max_vel_x": v.limit(),
        "min_vel_y": 0.0,
        "max_vel_y": 0.0,
        "max_vel_theta": w.limit(),
        "min_speed_xy": 0.0,
        "max_speed_xy": v.limit(),
        "min_speed_theta": 0.0,
        "acc_lim_x": a.limit(),
        "acc_lim_y": 0.0,
        "acc_lim_theta": b.limit(),
        "decel_lim_x": a.limit("decelerates as it accelerates", -1.0),
        "decel_lim_y": 0.0,
        "decel_lim_theta": b.limit("decelerates as it accelerates", -1.0),
        "vx_samples": 20,
        "vy_samples": 5,
        "vtheta_samples": 20,
        "sim_time": Explained(
            rounded(sim_time), f"half of the horizon of {short(figures.horizon.number)} s, limited to 1 to 2"
        ),
        "linear_granularity": figures.resolution.explained("a cell"),
        "angular_granularity": 0.025,
        "transform_tolerance": 0.2,
        "xy_goal_tolerance": figures.goal_tolerance.explained(),
        "trans_stopped_velocity": v.times(STOPPED, f"{STOPPED:g} of the full speed"),
        "short_circuit_trajectory_evaluation": True,
        "stateful": True,
        "critics": [
            "RotateToGoal",
            "Oscillation",
            "BaseObstacle",
            "GoalAlign",
            "PathAlign",
            "PathDist",
            "GoalDist",
        ],
        "BaseObstacle": {"scale": 0.02},
        "PathAlign": {"scale": 32.0, "forward_point_distance": point},
        "GoalAlign": {"scale": 24.0, "forward_point_distance": point},
        "PathDist": {"scale": 32.0},
        "GoalDist": {"scale": 24.0},
        "RotateToGoal": {"scale": 32.0, "slowing_factor": 5.0, "lookahead_time": -1.0},
    }

"""Nav2's controller server: MPPI by default, DWB for small computers, both within the robot's limits.

MPPI's distances are Nav2's example values over what its example robot reaches in its horizon (0.5 m/s for 56 steps
of 0.05 s: 1.4 m), times what this robot reaches: https://docs.nav2.org/configuration/packages/configuring-mppic.html
"""

from __future__ import annotations

import math

from chefbot.design.export.ros2.annotated_yaml import Explained, Tree, rounded, short
from chefbot.design.export.ros2.derived_nav_params import Figures
from chefbot.robot.motion_limits import turn_rate_on_spot

EXAMPLE_SPEED, EXAMPLE_TURN, EXAMPLE_AHEAD, EXAMPLE_CELL = 0.5, 1.9, 1.4, 0.05
"""Nav2's example robot: m/s, rad/s, m, m."""
CRAWL = 0.02
"""Share of the full speed above which the robot never counts as standing."""
STANDSTILL_SHARE = 0.1
"""Share of the full speed that counts as standing."""


def controller_server(figures: Figures) -> Tree:
    """Return goal checker, progress checker and the two controllers of the topic controller_selector."""
    robot = figures.robot
    tick = robot.metres_per_tick * robot.sensors.imu.rate
    slowest = min(tick, CRAWL * figures.speed.number)
    turning = min(turn_rate_on_spot(robot, tick), CRAWL * figures.turn.number)
    return {
        "controller_frequency": figures.frequency.explained(),
        "min_x_velocity_threshold": Explained(
            rounded(slowest),
            f"one encoder tick, {short(1000 * robot.metres_per_tick)} mm, per odometry message of"
            f" {short(robot.sensors.imu.rate)} Hz; a lower speed may be standstill; {CRAWL:g} of full speed at most",
        ),
        "min_theta_velocity_threshold": Explained(
            rounded(turning),
            f"both wheels at that speed: 2 x speed / separation; {CRAWL:g} of the full turn rate at most",
        ),
        "progress_checker": {
            "plugin": Explained(
                "nav2_controller::PoseProgressChecker", "a turn on the spot counts as progress"
            ),
            "required_movement_radius": figures.radius.explained(),
        },
        "general_goal_checker": {
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
    return {
        "motion_model": Explained("DiffDrive", "two driven wheels"),
        "model_dt": Explained(
            1.0 / hz, "exactly 1 / controller_frequency, otherwise MPPI does not shift its control sequence"
        ),
        "time_steps": Explained(steps, f"horizon x frequency; {figures.horizon.derivation}"),
        "vx_max": v.limit(),
        "vx_min": Explained(-v.number / 2, "half of it in reverse: the scan covers the rear")
        if figures.scan_sensor.covers_rear
        else Explained(0.0, f"no reverse: the {figures.scan_sensor.sensor} does not cover the rear"),
        "wz_max": w.limit(),
        "ax_max": figures.acceleration.limit(),
        "ax_min": figures.acceleration.limit("decelerates as it accelerates", -1.0),
        "az_max": figures.turn_acceleration.limit(),
        "vx_std": v.times(0.2 / EXAMPLE_SPEED, "0.2 at 0.5 m/s in Nav2's example: the same share"),
        "wz_std": w.times(0.4 / EXAMPLE_TURN, "0.4 at 1.9 rad/s in Nav2's example: the same share"),
        "prune_distance": figures.lookahead.times(
            1.7 / EXAMPLE_AHEAD, f"1.7 / 1.4 of {figures.lookahead.derivation}"
        ),
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

    far, near = figures.lookahead.explained(), metres(0.5)
    shape = "rectangular footprint" if figures.polygon else "circular footprint"
    return {
        "CostCritic": {
            "consider_footprint": Explained(bool(figures.polygon), shape),
            "near_goal_distance": metres(1.0),
        },
        "GoalCritic": {"threshold_to_consider": far},
        "GoalAngleCritic": {"threshold_to_consider": near},
        "PathAlignCritic": {"threshold_to_consider": near, "offset_from_furthest": points(20)},
        "PathFollowCritic": {"threshold_to_consider": far, "offset_from_furthest": points(5)},
        "PathAngleCritic": {"threshold_to_consider": near, "offset_from_furthest": points(4)},
        "PreferForwardCritic": {"threshold_to_consider": near},
    }


def dwb(figures: Figures) -> Tree:
    """Return the parameters of DWB; it keeps one twist for the entire look-ahead, so half of MPPI's horizon."""
    v, w, a, b = figures.speed, figures.turn, figures.acceleration, figures.turn_acceleration
    sim_time = min(max(figures.horizon.number / 2, 1.0), 2.0)
    point = figures.radius.times(2.0 / 3.0, "two thirds of the radius ahead of the centre")
    return {
        "max_vel_x": v.limit(),
        "max_vel_theta": w.limit(),
        "max_speed_xy": v.limit(),
        "acc_lim_x": a.limit(),
        "acc_lim_theta": b.limit(),
        "decel_lim_x": a.limit("decelerates as it accelerates", -1.0),
        "decel_lim_theta": b.limit("decelerates as it accelerates", -1.0),
        "sim_time": Explained(
            rounded(sim_time), f"half of the horizon of {short(figures.horizon.number)} s, limited to 1 to 2"
        ),
        "linear_granularity": figures.resolution.explained("a cell"),
        "xy_goal_tolerance": figures.goal_tolerance.explained(),
        "trans_stopped_velocity": v.times(STANDSTILL_SHARE, f"{STANDSTILL_SHARE:g} of the full speed"),
        "PathAlign": {"forward_point_distance": point},
        "GoalAlign": {"forward_point_distance": point},
    }

"""Pictures of what the robot makes of what it senses, drawn out of the logs of two demos."""

from __future__ import annotations

import math

import numpy as np
from picture_tools import (
    BLUE,
    GREEN,
    ORANGE,
    RED,
    SEED,
    canvas,
    draw_costs,
    draw_grid,
    draw_robot,
    run,
    said,
    scans_with_odometry,
    second_launch,
    snapshot,
    trajectory,
    truth,
    window,
    write,
)

from chefbot.control.dwa import DwaController
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.demo.summary import ground_truth_map
from chefbot.exploration.explorer import Explorer
from chefbot.exploration.frontiers import find_frontiers
from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, WheelTicks
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.readings import WheelCounts
from chefbot.planning.grid_planner import GridPlanner
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.sim.world.world import load_world
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator
from chefbot.slam.params import GmappingParams
from chefbot.slam.scan_beams import beams_of
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places


def slam() -> None:
    """The same scans drawn where odometry says, and where the particle filter says."""
    robot, end = load_robot("chefbot_lidar"), second_launch("chefbot_lidar")
    lidar = robot.sensors.lidar
    assert lidar is not None
    mount, wheels = lidar.mount.planar, Ekf(DriveModel.of(robot))
    ticks = [m for t, m in said("chefbot_lidar", "wheel_ticks", WheelTicks) if t < end]
    by_wheels = {}
    for m in ticks:
        wheels.add(WheelCounts(m.header.stamp.ns, m.left, m.right))
        by_wheels[m.header.stamp.ns / 1e9] = wheels.estimate.pose
    params = GmappingParams(seed=SEED)
    drawn, mapper = OccupancyAccumulator(params.resolution, params.max_cells), Gmapping(params, mount)
    for stamp, scan, _ in scans_with_odometry("chefbot_lidar", 0.0, end):
        pose = by_wheels[stamp]
        if mapper.update(scan.angles, scan.ranges, pose, scan.range_max):
            ranges = np.where(scan.ranges >= scan.range_max, np.float32(np.inf), scan.ranges)
            beams = beams_of(scan.angles, ranges, mount, params.max_range, params.clear_range)
            drawn.add_scan(beams, pose.array())
    plan = ground_truth_map(load_world("hotel"), robot)
    figure, axes = canvas(3, 11.0, 3.4)
    draw_grid(axes[0], drawn.grid(), "scans at the poses of the wheels alone")
    draw_grid(axes[1], mapper.map(), f"the same, with {params.particles} particles")
    draw_grid(axes[2], plan, "the truth")
    for one in axes:
        window(one, plan)
    write(figure, "slam")


def exploration() -> None:
    """Four moments of the growing map, with frontiers and the goal chosen."""
    robot = load_robot("chefbot")
    camera = robot.sensors.depth_camera
    assert camera is not None
    maps = [(t, m) for t, m in said("chefbot", "map", OccupancyGrid) if t < second_launch("chefbot")]
    plan = ground_truth_map(load_world("hotel"), robot)
    times, poses = truth("chefbot")
    figure, axes = canvas(4, 12.0, 2.8)
    for one, share in zip(axes, (0.05, 0.2, 0.5, 0.95), strict=True):
        time, message = maps[int(share * (len(maps) - 1))]
        grid, here = message.grid, SE2.of(poses[int(np.argmin(np.abs(times - time)))])
        explorer = Explorer(robot.circumscribed_radius, camera.field_of_view)
        costs = LayeredCostmap(CostmapParams(), robot.footprint)
        costs.set_static(grid)
        goal = explorer.decide(grid, GridPlanner().potential(costs.update(), here), here).goal
        draw_grid(one, grid, f"{time:.0f} s")
        for frontier in find_frontiers(
            grid, explorer.params.free_threshold, explorer.params.max_frontier_length
        ):
            if frontier.length >= explorer.min_frontier_length:
                x, y = (frontier.cells[:, ::-1] + 0.5).T * grid.resolution
                one.plot(x + grid.origin_x, y + grid.origin_y, ".", color=ORANGE, ms=1.5)
        if goal:
            one.plot(goal.pose.x, goal.pose.y, "*", color=RED, ms=9, zorder=7)
        draw_robot(one, here, 2 * robot.circumscribed_radius)
        window(one, plan)
    write(figure, "exploration")


def amcl() -> None:
    """From everywhere to one place."""
    robot, begin = load_robot("chefbot_lidar"), second_launch("chefbot_lidar")
    lidar, grid = robot.sensors.lidar, load_map(run("chefbot_lidar") / "map.yaml")
    assert lidar is not None
    filter_, times_poses = Amcl(AmclParams(seed=SEED), grid, lidar.mount.planar), truth("chefbot_lidar")
    figure, axes = canvas(4, 12.0, 2.9)
    shown = {1: 1, 2: 2, 8: 3}
    updates = 0
    scans = scans_with_odometry("chefbot_lidar", begin, begin + 120.0)
    snapshot(axes[0], grid, filter_, "before the first scan", None)
    for stamp, scan, odom in scans:
        if filter_.update(scan.angles, scan.ranges, scan.range_max, odom):
            updates += 1
            if updates in shown:
                here = SE2.of(times_poses[1][int(np.argmin(np.abs(times_poses[0] - stamp)))])
                known = "sure" if filter_.converged else "not sure"
                snapshot(axes[shown[updates]], grid, filter_, f"after scan {updates}: {known}", here)
    write(figure, "amcl")


def planning() -> None:
    """The costs of the hotel, and a path through them."""
    robot, folder = load_robot("chefbot"), run("chefbot")
    costs = LayeredCostmap(CostmapParams(), robot.footprint)
    costs.set_static(load_map(folder / "map.yaml"))
    places = load_places(folder / "map.places.yaml")
    costmap, planner = costs.update(), GridPlanner()
    path = planner.plan(costmap, places["kitchen"], places["table_8"])
    figure, (whole, part) = canvas(2, 10.0, 4.0)
    for axes in (whole, part):
        draw_costs(axes, costmap)
        axes.plot(path[:, 0], path[:, 1], color=BLUE, lw=1.6)
        draw_robot(axes, places["kitchen"], robot.circumscribed_radius)
        axes.plot(*places["table_8"][:2], "*", color=GREEN, ms=11)
    whole.set_title("costs of the map, and the path from the kitchen to table 8", fontsize=10)
    part.set(xlim=(3.0, 9.5), ylim=(0.5, 5.5))
    part.set_title("a part of it: it keeps away where there is room", fontsize=10)
    write(figure, "planning")


def dwa() -> None:
    """Trajectories of the candidates before an obstacle."""
    robot = load_robot("chefbot")
    limits, costs = (
        Limits.of(robot),
        LayeredCostmap(CostmapParams(track_unknown=False), robot.footprint, rolling=True),
    )
    angles = np.linspace(-0.3, 0.3, 60)
    costs.mark_and_clear("laser", SE2(0.0, 0.12, 0.0), angles, np.full(60, 0.6))
    costmap, here, now = costs.update(), SE2(0.0, 0.0, 0.0), (0.3, 0.0)
    line = np.linspace(0.0, 1.8, 37)
    path = np.column_stack(
        [
            line,
            -0.45 * np.sin(line / 1.8 * math.pi),
            np.arctan2(-0.45 * math.pi / 1.8 * np.cos(line / 1.8 * math.pi), 1),
        ]
    )
    controller = DwaController(limits)
    controller.set_path(path)
    v, w, _ = controller.command(here, now, costmap)
    figure, axes = canvas(1, 6.4, 4.0)
    draw_costs(axes, costmap)
    for speed in (0.12, 0.23, limits.speed):
        for turn in np.linspace(-limits.angular_speed, limits.angular_speed, 25):
            if speed + abs(turn) * limits.separation / 2 <= limits.wheel_speed:
                trajectory(axes, costmap, now, (speed, float(turn)), limits)
    axes.plot(path[:, 0], path[:, 1], color=BLUE, lw=1.2, ls="--", label="path")
    trajectory(axes, costmap, now, (v, w), limits, chosen=True)
    draw_robot(axes, here, robot.circumscribed_radius)
    axes.set(xlim=(-0.25, 1.25), ylim=(-0.6, 0.5))
    axes.set_title(f"chosen: {v:.2f} m/s, {w:.2f} rad/s", fontsize=10)
    write(figure, "dwa")


def delivery() -> None:
    """Where it was and where it thought it was, and what the waiter said meanwhile."""
    times, poses = truth("chefbot")
    begin, home = second_launch("chefbot"), times[-1]
    states = [(t, s) for t, s in said("chefbot", "delivery_status", DeliveryStatus) if t >= begin]
    figure, axes = canvas(1, 10.0, 2.6)
    moving = times >= begin
    speed = np.hypot(*np.gradient(poses[:, :2], times, axis=0).T)
    axes.plot(times[moving], speed[moving], color=BLUE, lw=0.8)
    for (time, status), following in zip(states, [*(t for t, _ in states[1:]), home], strict=True):
        if status.state in ("loading", "waiting"):
            axes.axvspan(time, following, color=ORANGE if status.state == "waiting" else GREEN, alpha=0.3)
            axes.annotate(f"{status.state}\n{status.place.replace('_', ' ')}", (time, 0.38), fontsize=8)
    axes.set(xlabel="time [s]", ylabel="true speed [m/s]", ylim=(0, 0.48), xlim=(begin, home))
    write(figure, "delivery")


def hotel() -> None:
    """The first picture of the README."""
    robot, world = load_robot("chefbot"), load_world("hotel")
    folder, plan = run("chefbot"), ground_truth_map(load_world("hotel"), robot)
    times, poses = truth("chefbot")
    mapping = times < second_launch("chefbot")
    figure, (left, right) = canvas(2, 11.0, 4.9)
    draw_grid(left, plan, "the hotel, and how the robot drove to map it")
    left.plot(*poses[mapping, :2].T, color=BLUE, lw=0.9)
    draw_grid(right, load_map(folder / "map.yaml"), "the map that it made, and its path to three tables")
    right.plot(*poses[~mapping, :2].T, color=ORANGE, lw=1.2)
    stops = {s.place for _, s in said("chefbot", "delivery_status", DeliveryStatus) if s.state == "waiting"}
    for name, pose in load_places(folder / "map.places.yaml").items():
        shown = name in stops or name == "kitchen"
        for axes in (right,) if shown else ():
            axes.plot(pose.x, pose.y, "o", color=RED if name in stops else GREEN, ms=6)
            axes.annotate(
                name.replace("_", " "), (pose.x, pose.y), (5, 6), textcoords="offset points", fontsize=9
            )
    for axes in (left, right):
        window(axes, plan)
        draw_robot(axes, SE2(0.0, 0.0, world.start.yaw), 2 * robot.circumscribed_radius)
    write(figure, "hotel")

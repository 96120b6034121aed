"""Makes docs/pictures/*.png from real runs: `python docs/make_pictures.py [folder for the runs]`.

Two demos in the hotel, one with the depth camera and one with the lidar, are run first unless the folder
(runs/pictures) holds them already. Everything drawn comes out of their logs or out of the library itself.
"""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
from matplotlib.patches import Circle, Rectangle
from picture_tools import (
    BLUE,
    GREEN,
    ORANGE,
    PICTURES,
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

from chefbot.commands.summary import true_plan
from chefbot.control.dwa import Dwa
from chefbot.control.kinematics import wheel_speeds
from chefbot.control.limiter import Limiter
from chefbot.control.limits import Limits
from chefbot.costmap.layers import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.exploration.explorer import Explorer
from chefbot.exploration.frontiers import find_frontiers
from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, WheelTicks
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.odometry.dead_reckoning import DeadReckoning
from chefbot.odometry.gyro_ekf import GyroEkf
from chefbot.planning.grid_planner import GridPlanner
from chefbot.robot.load import load_robot
from chefbot.runtime.files import load_map
from chefbot.runtime.places import load_places
from chefbot.scan.camera import CameraModel
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.sim.board import Board
from chefbot.sim.depth_camera import DepthRenderer
from chefbot.sim.simulation import Simulation
from chefbot.sim.world import load_world
from chefbot.slam.beams import beams_of
from chefbot.slam.canvas import Canvas
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

# -- pictures


def hotel() -> None:
    """The first picture of the README."""
    robot, world = load_robot("chefbot"), load_world("hotel")
    folder, plan = run("chefbot"), true_plan(load_world("hotel"), robot)
    times, poses = truth("chefbot")
    mapping = times < second_launch("chefbot")
    figure, (left, right) = canvas(2, 11.0, 4.9)
    draw_grid(left, plan, "the hotel, and how the robot drove to map it")
    left.plot(*poses[mapping, :2].T, color=BLUE, lw=0.9)
    draw_grid(right, load_map(folder / "map.yaml"), "the map that it made, and its way to three tables")
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
        draw_robot(axes, SE2(0.0, 0.0, world.start.yaw), 2 * robot.footprint_radius)
    write(figure, "hotel")


def robot_from_its_file() -> None:
    """Top view, and the speeds that the motors allow."""
    robot = load_robot("chefbot")
    figure, (plan, speeds) = canvas(2, 9.0, 3.8)
    half, wheel = robot.wheels.separation / 2, robot.wheel_radius
    plan.add_patch(Circle((0, 0), robot.body.radius, facecolor="#eef2f7", edgecolor="black"))
    for side in (-half, half):
        corner = (-wheel, side - robot.wheels.width / 2)
        plan.add_patch(Rectangle(corner, 2 * wheel, robot.wheels.width, color="black"))
    for x in (-robot.casters.offset, robot.casters.offset):
        plan.add_patch(Circle((x, 0), robot.casters.radius, facecolor="white", edgecolor="black"))
    plan.add_patch(Circle((0, 0), robot.footprint_radius, fill=False, ls=":", edgecolor=RED))
    for name, below in (("imu", -12), ("ultrasonic", -12), ("depth_camera", 8)):
        mount = getattr(robot.sensors, name).mount
        plan.plot(mount.x, mount.y, "s", color=BLUE, ms=4)
        at, label = (mount.x, mount.y), name.replace("_", " ")
        plan.annotate(label, at, (-14, below), textcoords="offset points", fontsize=8, color=BLUE)
    plan.set(
        xlim=(-0.25, 0.25), ylim=(-0.2, 0.2), aspect="equal", xlabel="x, forward [m]", ylabel="y, left [m]"
    )
    plan.set_title("from above; dotted: must stay free", fontsize=10)
    limits = Limits.of(robot)
    v, w = np.meshgrid(np.linspace(0, 0.4, 201), np.linspace(-1.5, 1.5, 301))
    rim = v + np.abs(w) * limits.separation / 2
    allowed = (rim <= limits.wheel_speed) & (v <= limits.speed) & (np.abs(w) <= limits.turn)
    speeds.contourf(w, v, allowed.astype(float), levels=[0.5, 1.5], colors=["#cfe3ff"])
    turns = np.linspace(-1.5, 1.5, 301)
    speeds.plot(
        turns, limits.wheel_speed - np.abs(turns) * limits.separation / 2, color=ORANGE, label="motors"
    )
    speeds.axhline(limits.speed, color=GREEN, label="owner: speed")
    speeds.axvline(-limits.turn, color=RED, label="owner: turn")
    speeds.axvline(limits.turn, color=RED)
    speeds.set(xlabel="turn rate [rad/s]", ylabel="speed [m/s]", ylim=(0, 0.42))
    speeds.set_title("twists that the base may drive", fontsize=10)
    speeds.legend(fontsize=8, loc="lower center")
    write(figure, "robot")


def seen_by_the_camera() -> None:
    """Colour picture, depth picture, and the scan made of it."""
    robot, world = load_robot("chefbot"), load_world("hotel")
    camera = robot.sensors.depth_camera
    assert camera is not None
    sim = Simulation(robot, world, "real", seed=SEED, start=SE2(4.2, 0.75, math.radians(-8.0)), people=2)
    frame = DepthRenderer(camera, "real", SEED).frame(sim.capture(), 0, colour=True)
    scanner = DepthToScan(CameraModel.of(camera), DepthToScanParams())
    ranges = scanner.convert(frame.depth)
    figure, (colour, depth, scan) = canvas(3, 11.0, 2.9)
    colour.imshow(frame.colour)
    colour.set_title("the room", fontsize=10)
    shown = depth.imshow(frame.depth, cmap="viridis")
    first, last = scanner.scan_rows
    depth.axhspan(first - 1, last + 1, color=RED, alpha=0.8)
    depth.set_title("depth [m]; red: the rows of the scan", fontsize=10)
    figure.colorbar(shown, ax=depth, shrink=0.7)
    scan.plot(ranges * np.cos(scanner.angles), ranges * np.sin(scanner.angles), ".", color=RED, ms=2)
    edge = camera.range_max * np.array([[0, 0], [1, math.tan(camera.field_of_view / 2)]])
    for sign in (1, -1):
        scan.plot(edge[:, 0], sign * edge[:, 1], color="0.7", lw=0.8)
    scan.set(xlim=(0, camera.range_max), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    scan.set_title("the scan from above", fontsize=10)
    for axes in (colour, depth):
        axes.set_xticks([])
        axes.set_yticks([])
    write(figure, "depth_to_scan")


def simulated_world() -> None:
    """What the robot's camera sees from three places, with people."""
    robot, world = load_robot("chefbot"), load_world("hotel")
    camera = robot.sensors.depth_camera
    assert camera is not None
    figure, views = canvas(3, 11.0, 2.9)
    for axes, place in zip(views, ((0.0, 0.5, 20.0), (3.9, 4.9, -32.0), (1.0, 6.2, 100.0)), strict=True):
        start = SE2(place[0], place[1], math.radians(place[2]))
        sim = Simulation(robot, world, "real", seed=SEED, start=start, people=4)
        frame = DepthRenderer(camera, "real", SEED).frame(sim.capture(), 0, colour=True)
        axes.imshow(frame.colour)
        axes.set_xticks([])
        axes.set_yticks([])
    write(figure, "world")


def odometry() -> None:
    """Wheels alone and wheels with gyro, against the truth."""
    robot = load_robot("chefbot")
    sim = Simulation(robot, load_world("empty"), "real", seed=SEED)
    board, limiter = Board(robot, sim), Limiter(Limits.of(robot))
    wheels, both = DeadReckoning(robot), GyroEkf(robot)
    rows, covariance = [], []
    for tick in range(1, 50 * 170):
        board.run_until(tick * 20_000_000)
        rate, counts = float(sim.imu()[0][2]), sim.wheel_ticks()
        a, b = wheels.update(*counts, 0.02), both.update(*counts, rate, 0.02)
        if tick % 5 == 0:
            turn = 0.3 if (tick // 1047) % 2 else -0.3  # a circle to the left, one to the right
            left, right = wheel_speeds(*limiter.step(0.3, turn, 0.0, 0.1), robot)
            board.command(left * robot.wheel_radius, right * robot.wheel_radius)
            rows.append([tick * 0.02, *sim.truth().pose, *a.pose, *b.pose])
            covariance.append([math.sqrt(np.trace(e.covariance[:2, :2])) for e in (a, b)])
    data, sigma = np.array(rows), np.array(covariance)
    figure, (way, error) = canvas(2, 9.0, 3.5)
    for axes_column, colour, label in ((4, ORANGE, "wheels alone"), (7, GREEN, "wheels and gyro")):
        way.plot(data[:, axes_column], data[:, axes_column + 1], color=colour, lw=1, label=label)
        off = np.hypot(*(data[:, axes_column : axes_column + 2] - data[:, 1:3]).T)
        error.plot(data[:, 0], off, color=colour, label=f"{label}: error")
        error.plot(
            data[:, 0], sigma[:, axes_column // 7], color=colour, ls=":", label="its own standard deviation"
        )
    way.plot(data[:, 1], data[:, 2], color=BLUE, lw=1, label="truth")
    way.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    way.set_title(f"{0.3 * data[-1, 0]:.0f} m in figures of eight", fontsize=10)
    error.set(xlabel="time [s]", ylabel="position error [m]", ylim=(0, None))
    for axes in (way, error):
        axes.legend(fontsize=8)
    write(figure, "odometry")


def slam() -> None:
    """The same scans drawn where odometry says, and where the particle filter says."""
    robot, end = load_robot("chefbot_lidar"), second_launch("chefbot_lidar")
    lidar = robot.sensors.lidar
    assert lidar is not None
    mount, wheels = lidar.mount.planar, DeadReckoning(robot)
    ticks = [m for t, m in said("chefbot_lidar", "wheel_ticks", WheelTicks) if t < end]
    by_wheels = {m.header.stamp.ns / 1e9: wheels.update(m.left, m.right, 0.02).pose for m in ticks}
    params = GmappingParams(seed=SEED)
    drawn, mapper = Canvas(params.resolution, params.max_cells), Gmapping(params, mount)
    for stamp, scan, _ in scans_with_odometry("chefbot_lidar", 0.0, end):
        pose = by_wheels[stamp]
        if mapper.update(scan.angles, scan.ranges, pose, scan.range_max):
            ranges = np.where(scan.ranges >= scan.range_max, np.float32(np.inf), scan.ranges)
            beams = beams_of(scan.angles, ranges, mount, params.max_range, params.clear_range)
            drawn.draw(beams, pose.array())
    plan = true_plan(load_world("hotel"), robot)
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
    plan = true_plan(load_world("hotel"), robot)
    times, poses = truth("chefbot")
    figure, axes = canvas(4, 12.0, 2.8)
    for one, share in zip(axes, (0.05, 0.2, 0.5, 0.95), strict=True):
        time, message = maps[int(share * (len(maps) - 1))]
        grid, here = message.grid, SE2.of(poses[int(np.argmin(np.abs(times - time)))])
        explorer = Explorer(robot.footprint_radius, camera.field_of_view)
        costs = LayeredCostmap(CostmapParams(), robot.footprint_radius)
        costs.set_static(grid)
        goal = explorer.decide(grid, GridPlanner().potential(costs.update(), here), here).goal
        draw_grid(one, grid, f"{time:.0f} s")
        for frontier in find_frontiers(grid, explorer.params.free_below, explorer.params.longest):
            if frontier.length >= explorer.least_length:
                x, y = (frontier.cells[:, ::-1] + 0.5).T * grid.resolution
                one.plot(x + grid.origin_x, y + grid.origin_y, ".", color=ORANGE, ms=1.5)
        if goal:
            one.plot(goal.pose.x, goal.pose.y, "*", color=RED, ms=9, zorder=7)
        draw_robot(one, here, 2 * robot.footprint_radius)
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
    costs = LayeredCostmap(CostmapParams(), robot.footprint_radius)
    costs.set_static(load_map(folder / "map.yaml"))
    places = load_places(folder / "map.places.yaml")
    costmap, planner = costs.update(), GridPlanner()
    path = planner.plan(costmap, places["kitchen"], places["table_8"])
    figure, (whole, part) = canvas(2, 10.0, 4.0)
    for axes in (whole, part):
        draw_costs(axes, costmap)
        axes.plot(path[:, 0], path[:, 1], color=BLUE, lw=1.6)
        draw_robot(axes, places["kitchen"], robot.footprint_radius)
        axes.plot(*places["table_8"][:2], "*", color=GREEN, ms=11)
    whole.set_title("costs of the map, and the way from the kitchen to table 8", fontsize=10)
    part.set(xlim=(3.0, 9.5), ylim=(0.5, 5.5))
    part.set_title("a part of it: it keeps away where there is room", fontsize=10)
    write(figure, "planning")


def dwa() -> None:
    """Trajectories of the candidates before an obstacle."""
    robot = load_robot("chefbot")
    limits, costs = (
        Limits.of(robot),
        LayeredCostmap(CostmapParams(track_unknown=False), robot.footprint_radius, rolling=True),
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
    controller = Dwa(limits)
    controller.set_path(path)
    v, w, _ = controller.command(here, now, costmap)
    figure, axes = canvas(1, 6.4, 4.0)
    draw_costs(axes, costmap)
    for speed in (0.12, 0.23, limits.speed):
        for turn in np.linspace(-limits.turn, limits.turn, 25):
            if speed + abs(turn) * limits.separation / 2 <= limits.wheel_speed:
                trajectory(axes, costmap, now, (speed, float(turn)), limits)
    axes.plot(path[:, 0], path[:, 1], color=BLUE, lw=1.2, ls="--", label="path")
    trajectory(axes, costmap, now, (v, w), limits, chosen=True)
    draw_robot(axes, here, robot.footprint_radius)
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


def calibration() -> None:
    """Before and after, as the verb draws it."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/pictures") / "calibration"
    if not (folder / "calibration.png").exists():
        command = [
            sys.executable,
            "-m",
            "chefbot",
            "calibrate",
            "chefbot_lidar",
            "--sim",
            "--seed",
            str(SEED),
        ]
        subprocess.run([*command, "--out", str(folder)], check=True)
    (PICTURES / "calibration.png").write_bytes((folder / "calibration.png").read_bytes())


ALL = (
    hotel,
    robot_from_its_file,
    simulated_world,
    seen_by_the_camera,
    odometry,
    slam,
    exploration,
    amcl,
    planning,
    dwa,
    delivery,
    calibration,
)


def main() -> None:
    """All pictures, or those named on the command line behind the folder."""
    PICTURES.mkdir(exist_ok=True)
    wanted = sys.argv[2:]
    for picture in ALL:
        if not wanted or picture.__name__ in wanted:
            picture()


if __name__ == "__main__":
    main()

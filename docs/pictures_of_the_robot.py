"""Pictures of the robot, its world and its senses, drawn out of the library itself."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
from matplotlib.patches import Circle, Rectangle
from picture_tools import (
    BLUE,
    GREEN,
    ORANGE,
    PICTURES,
    RED,
    RUNS,
    SEED,
    canvas,
    copied,
    write,
)

from chefbot.buildings.generate import generate
from chefbot.cli.world.draw import picture
from chefbot.control.kinematics import wheel_speeds
from chefbot.maths.se2 import SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.readings import UNMEASURED_VARIANCES, ImuReading, WheelCounts
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter
from chefbot.scan.camera import CameraModel
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.cameras.depth_camera import DepthRenderer
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import build_world, load_world


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
    plan.add_patch(Circle((0, 0), robot.circumscribed_radius, fill=False, ls=":", edgecolor=RED))
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
    allowed = (rim <= limits.wheel_speed) & (v <= limits.speed) & (np.abs(w) <= limits.angular_speed)
    speeds.contourf(w, v, allowed.astype(float), levels=[0.5, 1.5], colors=["#cfe3ff"])
    turns = np.linspace(-1.5, 1.5, 301)
    speeds.plot(
        turns, limits.wheel_speed - np.abs(turns) * limits.separation / 2, color=ORANGE, label="motors"
    )
    speeds.axhline(limits.speed, color=GREEN, label="owner: speed")
    speeds.axvline(-limits.angular_speed, color=RED, label="owner: turn")
    speeds.axvline(limits.angular_speed, color=RED)
    speeds.set(xlabel="turn rate [rad/s]", ylabel="speed [m/s]", ylim=(0, 0.42))
    speeds.set_title("twists that the base may drive", fontsize=10)
    speeds.legend(fontsize=8, loc="lower center")
    write(figure, "robot")


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


def generated_office() -> None:
    """A generated office building from above."""
    robot = load_robot("chefbot")
    PICTURES.mkdir(parents=True, exist_ok=True)
    spec = generate("office", 7, {"width": 30.0, "depth": 20.0}, robot.circumscribed_radius)
    (PICTURES / "office.png").write_bytes(picture(build_world(spec, spec.name), robot))


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


def odometry() -> None:
    """Wheels alone and wheels with gyro, against the truth."""
    robot = load_robot("chefbot")
    sim = Simulation(robot, load_world("empty"), "real", seed=SEED)
    board, limiter = SimulatedBoard(robot, sim), VelocityLimiter(Limits.of(robot))
    model = DriveModel.of(robot)
    wheels, both = Ekf(model), Ekf(model)
    variance = (*UNMEASURED_VARIANCES[:2], model.gyro_noise**2)
    rows, covariance = [], []
    for tick in range(1, 50 * 170):
        board.run_until(tick * 20_000_000)
        rate, counts = float(sim.imu()[0][2]), sim.wheel_ticks()
        both.add(ImuReading(tick * 20_000_000, (0.0, 0.0, rate), variance))
        for ekf in (wheels, both):
            ekf.add(WheelCounts(tick * 20_000_000, *counts))
        a, b = wheels.estimate, both.estimate
        if tick % 5 == 0:
            turn = 0.3 if (tick // 1047) % 2 else -0.3  # a circle to the left, one to the right
            board.command(*wheel_speeds(*limiter.step(0.3, turn, 0.0, 0.1), robot))
            rows.append([tick * 0.02, *sim.truth().pose, *a.pose, *b.pose])
            covariance.append([math.sqrt(np.trace(e.covariance[:2, :2])) for e in (a, b)])
    data, sigma = np.array(rows), np.array(covariance)
    figure, (path, error) = canvas(2, 9.0, 3.5)
    for axes_column, colour, label in ((4, ORANGE, "wheels alone"), (7, GREEN, "wheels and gyro")):
        path.plot(data[:, axes_column], data[:, axes_column + 1], color=colour, lw=1, label=label)
        off = np.hypot(*(data[:, axes_column : axes_column + 2] - data[:, 1:3]).T)
        error.plot(data[:, 0], off, color=colour, label=f"{label}: error")
        error.plot(
            data[:, 0], sigma[:, axes_column // 7], color=colour, ls=":", label="its own standard deviation"
        )
    path.plot(data[:, 1], data[:, 2], color=BLUE, lw=1, label="truth")
    path.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    path.set_title(f"{0.3 * data[-1, 0]:.0f} m in figures of eight", fontsize=10)
    error.set(xlabel="time [s]", ylabel="position error [m]", ylim=(0, None))
    for axes in (path, error):
        axes.legend(fontsize=8)
    write(figure, "odometry")


def calibration() -> None:
    """Before and after, as the verb draws it."""
    folder = RUNS / "calibration"
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
    copied(folder / "calibration.png")

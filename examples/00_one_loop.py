"""The whole robot in one loop, without nodes and messages: `python examples/00_one_loop.py [map.png]`."""

import sys
from pathlib import Path

from chefbot.control.controller import ControllerStatus
from chefbot.control.dwa import DwaController
from chefbot.control.kinematics import wheel_speeds
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.exploration.explorer import Explorer
from chefbot.maths.se2 import IDENTITY as HOME
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.planning.grid_planner import GridPlanner
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams
from chefbot.storage.map_files import map_png

TICK, SCAN, PLAN, LOOK = 0.02, 5, 50, 350  # s; ticks per scan, per plan, and of the first turn

robot, world = load_robot("chefbot_lidar"), load_world("room")
lidar, imu, limits = robot.sensors.lidar, robot.sensors.imu, Limits.of(robot)
angles, mount = lidar_angles(lidar), lidar.mount.planar

sim = Simulation(robot, world, profile="real", seed=1)
board = SimulatedBoard(robot, sim)  # controls the wheel speeds; stops after a timeout without commands
odometry = Ekf(DriveModel.of(robot))
gyro_variance, force_variance = [imu.gyro_noise**2] * 3, [imu.accelerometer_noise**2] * 3
slam = Gmapping(GmappingParams(seed=1), sensor=mount)
costs = LayeredCostmap(CostmapParams(), robot.footprint)
explorer, planner = Explorer(robot.circumscribed_radius), GridPlanner()
controller, limiter = DwaController(limits), VelocityLimiter(limits)

goal, status, twist, tick = None, ControllerStatus.NO_PATH, (0.0, 0.0), 0
while True:
    tick += 1
    board.run_until(stamp := round(tick * TICK * 1e9))  # advance the simulation
    rates, force = sim.imu()
    odometry.add(ImuReading(stamp, tuple(rates), gyro_variance, tuple(force), force_variance))
    odometry.add(WheelCounts(stamp, *sim.wheel_ticks()))
    if tick % SCAN:
        continue

    ranges = sim.lidar()
    if slam.update(angles, ranges, odometry.estimate.pose):
        costs.set_static(slam.map())
    costs.mark_and_clear("lidar", slam.pose @ mount, angles, ranges)
    costmap = costs.update()

    if tick > LOOK and (tick % PLAN == 0 or status is not ControllerStatus.RUNNING):
        grid = slam.map()
        if goal and status is ControllerStatus.REACHED and explorer.frontier_remains(grid, goal):
            explorer.mark_failed(goal)  # reached, and the frontier is still there
        if not goal or status is ControllerStatus.REACHED or not explorer.frontier_remains(grid, goal):
            goal = explorer.decide(grid, planner.potential(costmap, slam.pose), slam.pose).goal
        if not goal and slam.pose.distance(HOME) < 0.1:
            break  # no frontier left, and at home
        controller.set_path(planner.plan(costmap, slam.pose, goal.pose if goal else HOME))

    v, w, status = controller.command(slam.pose, twist, costmap)
    twist = limiter.step(v, w if tick > LOOK else limits.angular_speed, age=0.0, dt=SCAN * TICK)
    board.command(*wheel_speeds(*twist, robot))

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "one_loop_map.png")
picture.write_bytes(map_png(grid))
off = slam.pose.distance(world.start.between(sim.truth().pose))
print(f"drove for {tick * TICK:.0f} s with {sim.collisions().episodes} collisions")
print(f"mapped {grid.width * grid.resolution:.1f} x {grid.height * grid.resolution:.1f} m: {picture}")
print(f"localization error at home: {1000 * off:.0f} mm")

"""Task `drive_randomly`: random teleoperation while mapping."""

from __future__ import annotations

import math

from chefbot.msgs.geometry_msgs import Twist
from chefbot.proving.scenario_tasks import DriveRandomlyTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.robot.motion_limits import Limits

COMMAND_PERIOD = 0.1
"""Time between two commands, s."""
SEGMENT = (1.0, 4.0)
"""Range of the time that a speed is kept, s."""
RELEASE_TIME = 0.3
"""Time for which the driver lets go of the controls between two speeds, s: after a stop for a sensor the robot
waits for that."""
LOOK_AHEAD_DISTANCE = 0.8
"""Distance that a careful driver keeps free ahead, m."""
CLEARANCE = 0.15
"""Clearance of the robot there that a careful driver wants, m."""
TURN = 0.8
"""Yaw rate at which a careful driver turns away, rad/s."""


def drive_randomly(run: SimulatedRun) -> None:
    """Drive for the task's duration; the commands are drawn by the seed."""
    task = run.scenario.task
    assert isinstance(task, DriveRandomlyTask)
    run.launch("gmapping_demo", {})
    limits = Limits.of(run.system.robot)
    wanted = run.time + task.duration
    ends = min(wanted, run.scenario.limits.time)
    while run.time < ends:
        v, w = run.rng.uniform(0.0, limits.speed), run.rng.uniform(-1.0, 1.0) * min(limits.angular_speed, 1.5)
        released = run.time + RELEASE_TIME
        while run.time < min(released, ends):
            _command(run, Twist())
        segment_ends = run.time + run.rng.uniform(*SEGMENT)
        while run.time < min(segment_ends, ends):
            blocked = task.careful and _is_blocked(run)
            _command(run, Twist.of(0.0, math.copysign(TURN, w)) if blocked else Twist.of(v, w))
    if ends < wanted:
        raise TaskFailedError(f"the drive was not over after {ends:.0f} s")


def _command(run: SimulatedRun, command: Twist) -> None:
    run.publish("cmd_vel_teleop", command)
    run.run_for(COMMAND_PERIOD)


def _is_blocked(run: SimulatedRun) -> bool:
    """Return whether something is ahead, or beside the path ahead, by the ground truth."""
    assert run.safety.simulation is not None
    pose = run.safety.simulation.truth().pose
    ahead = (pose @ type(pose)(distance, 0.0, 0.0) for distance in (0.3, LOOK_AHEAD_DISTANCE))
    return any(run.safety.clearance(point) < CLEARANCE for point in ahead)

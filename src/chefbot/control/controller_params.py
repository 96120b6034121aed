"""Parameters of the controller plugin, and the built-in controller made from them."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.control.dwa import DwaController
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalParams
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot

CONTROL_RATE = 10.0
"""Rate of the controller's commands, Hz."""
CONTROL_PERIOD = 1.0 / CONTROL_RATE
"""Time between two commands, s."""
FORWARD_SENSING_ROTATE_FROM = 0.5
"""Heading error, rad, from which a robot that sees only ahead rotates in place at the latest: on a tight arc it would
drive out of its view."""
LIVE_PARAMS = (
    *("settings.sim_time", "settings.*_samples", "settings.*_weight", "settings.*slowing"),
    *("settings.rotate_from", "goal.*", "speed"),
)
"""Parameters of the controller that can change at run time."""
LOCAL_PLAN_RATE = 5.0
"""Rate at which the chosen trajectory is published for display, Hz."""


class ControllerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the controller plugin."""

    plugin: str = ""
    """`pkg.module:Class` of a custom controller; its constructor receives `settings`."""
    settings: DwaParams = DwaParams(period=CONTROL_PERIOD)
    goal: GoalParams = GoalParams()
    speed: Annotated[
        float,
        Meta(ge=0.1, le=1.0, description="fraction of the maximum speed that the built-in controller uses"),
    ] = 1.0

    def make_dwa(self, robot: Robot, settings: DwaParams) -> DwaController:
        """Return the built-in controller with `settings`, within the robot's limits at the fraction `speed`."""
        limits = Limits.of(robot)
        if robot.sensors.forward_sensing_only:
            rotate_from = min(settings.rotate_from, FORWARD_SENSING_ROTATE_FROM)
            settings = msgspec.structs.replace(settings, rotate_from=rotate_from)
        return DwaController(limits._replace(speed=limits.speed * self.speed), settings, self.goal)

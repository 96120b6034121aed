"""`chefbot robot check`: what is wrong with a robot before anything of it is cut, printed or bought.

Each rule is a file of its own; the shapes come from the robot's solids, the calculations from the design sheet.
"""

from __future__ import annotations

from chefbot.design.checks.drive_checks import check_drive
from chefbot.design.checks.finding import Finding
from chefbot.design.checks.ground_clearance import check_ground_clearance
from chefbot.design.checks.one_plane import check_one_plane
from chefbot.design.checks.overlaps import overlaps
from chefbot.design.checks.screw_holes import holes
from chefbot.design.checks.sensor_occlusion import check_sensor_views
from chefbot.design.checks.support import check_support
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.spec import Robot


def check(robot: Robot, catalogue: Catalogue) -> list[Finding]:
    """Return all findings, errors first; motors, drivers and batteries are suggested from the catalogue."""
    found = [
        *overlaps(robot),
        *check_ground_clearance(robot),
        *holes(robot),
        *check_support(robot),
        *check_sensor_views(robot),
        *check_one_plane(robot),
        *check_drive(robot, catalogue),
    ]
    return sorted(found, key=lambda finding: finding.severity != "error")

"""`chefbot check`: what is wrong with a robot before anything of it is cut, printed or bought.

Each rule is a file of its own; the shapes come from the robot's solids, the sums from the design sheet.
"""

from __future__ import annotations

from chefbot.design.check_drive import drives
from chefbot.design.check_finding import Finding
from chefbot.design.check_ground import ground
from chefbot.design.check_holes import holes
from chefbot.design.check_overlap import overlaps
from chefbot.design.check_seat import seats
from chefbot.design.check_view import views
from chefbot.robot.catalogue import Catalogue
from chefbot.robot.spec import Robot


def check(robot: Robot, catalogue: Catalogue) -> list[Finding]:
    """All findings, errors first; the catalogue is where other motors, drivers and batteries come from."""
    found = [
        *overlaps(robot),
        *ground(robot),
        *holes(robot),
        *seats(robot),
        *views(robot),
        *drives(robot, catalogue),
    ]
    return sorted(found, key=lambda finding: finding.severity != "error")

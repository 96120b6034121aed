"""Reports of causes: the base class of the nodes that make them, and what marked a cell of their costmap."""

from __future__ import annotations

from functools import cached_property

import msgspec

from chefbot.causes.episodes import Episodes
from chefbot.causes.obstacles import CellCentre
from chefbot.causes.reports import CAMERA, CONTACT, END, LIDAR, MAP, RANGER, MarkedPlace, is_zone, stamped
from chefbot.costmap import sources
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import STATIC
from chefbot.costmap.sources import LASER
from chefbot.msgs.chefbot_msgs import Cause, PresentCauses
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot
from chefbot.runtime.node import Node, Out, every


class CauseReportsNode(Node):
    """Base class of a node that publishes on `cause_reports` what its checks find, when it begins and ends."""

    cause_reports: Out[Cause]
    present_reports: Out[PresentCauses]

    @cached_property
    def _episodes(self) -> Episodes:
        return Episodes()

    def report(self, subject: str, found: Cause | None, delay_ns: int = 0) -> None:
        """Publish the begin, the change or the end of what is found about a subject; None: nothing is found.

        delay_ns: time for which something must be found before it is reported.
        """
        self._publish_reports(self._episodes.update(subject, found, self.now_ns, delay_ns))

    def end_reports(self) -> None:
        """Publish the end of all that is open, as at the end of a goal."""
        self._publish_reports(self._episodes.end_all())

    @every(hz=1)
    def publish_present_reports(self) -> None:
        """Publish what is open, also if that is nothing: the message of an end may have been lost."""
        header = Header.of(self.now_ns, "")
        self.present_reports.publish(PresentCauses(header, self.name, self._episodes.open_checks))

    def report_once(self, found: Cause) -> None:
        """Publish something that has no duration: it ends when it begins."""
        self._publish_reports([found, msgspec.structs.replace(found, kind=END)])

    def _publish_reports(self, reports: list[Cause]) -> None:
        for report in reports:
            self.cause_reports.publish(stamped(report, self.name, self.now_ns))


def marked_place(
    costs: LayeredCostmap, cell: CellCentre | None, frame: str, robot: Robot
) -> MarkedPlace | None:
    """Return the place of a cell with the sensor that marked it and when, or None for no cell or no mark."""
    mark = None if cell is None else costs.marked_by(*cell)
    if cell is None or mark is None:
        return None
    return MarkedPlace(marking_sensor(mark.source, robot), frame, *cell, round(mark.time * 1e9))


def marking_sensor(source: str, robot: Robot) -> str:
    """Return the sensor or zone of a source of marks; without a lidar the planar scan is the depth camera's."""
    if source == STATIC:
        return MAP
    if is_zone(source):
        return source
    if source == sources.CONTACT:
        return CONTACT
    if source == sources.RANGER:
        return RANGER
    if source == sources.GLASS:
        return LIDAR
    return LIDAR if source == LASER and robot.sensors.lidar is not None else CAMERA

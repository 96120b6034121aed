"""The causes of all nodes, each with its chain: what is behind it, what its obstacle is, and its sentence."""

from __future__ import annotations

import msgspec
import numpy as np

from chefbot.causes.chains import CauseChains, TrackedPoint
from chefbot.causes.statuses import StatusReports
from chefbot.delivery.status_messages import is_failure
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import (
    BatteryStatus,
    Cause,
    DeliveryStatus,
    EmergencyStopStatus,
    ExplorationStatus,
    NavigationStatus,
    PresentCauses,
)
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.people.people_messages import is_outdated
from chefbot.runtime.node import In, Node, NoParams, Out, every
from chefbot.runtime.transform_buffer import TransformError


class CausesNode(Node):
    """Publishes on `causes` why the robot slows down, stops, takes a detour or fails, and when that is over."""

    params: NoParams
    cause_reports: In[Cause]
    map: In[OccupancyGrid]
    navigation_status: In[NavigationStatus]
    stop_status: In[EmergencyStopStatus]
    battery_status: In[BatteryStatus]
    delivery_status: In[DeliveryStatus]
    exploration_status: In[ExplorationStatus]
    process_lost: In[String]
    process_back: In[String]
    tracked_people: In[TrackedPeople]
    causes: Out[Cause]
    present_reports: In[PresentCauses]
    present_causes: Out[PresentCauses]

    def start(self) -> None:
        """Start without causes and without known statuses."""
        self._chains, self._statuses = CauseChains(), StatusReports()

    def on_map(self, message: OccupancyGrid) -> None:
        """Keep the static map, to distinguish what is on it from what is not."""
        self._chains.set_map(message.grid)

    def on_cause_reports(self, report: Cause) -> None:
        """Publish the chain of what a node reports."""
        self._publish([report])

    def on_present_reports(self, reports: PresentCauses) -> None:
        """Publish the ends of what a node does not find any more, if their messages were lost."""
        checks = (*reports.checks, *self._statuses.open_checks(reports.node))
        for end in self._chains.lost_ends(reports.node, checks, reports.header.stamp.ns):
            self.causes.publish(end)

    @every(hz=1)
    def publish_present_causes(self) -> None:
        """Publish what holds now, for those who have lost the message of an end."""
        ids = np.array(self._chains.present, np.uint32)
        self.present_causes.publish(PresentCauses(Header.of(self.now_ns, ""), ids=ids))

    def on_navigation_status(self, status: NavigationStatus) -> None:
        """Report recoveries and goals that are given up."""
        self._publish(self._statuses.navigation(status, self.now_ns))

    def on_exploration_status(self, status: ExplorationStatus) -> None:
        """Report no goals that the explorer itself cancels."""
        self._statuses.exploring = not status.done

    def on_stop_status(self, status: EmergencyStopStatus) -> None:
        """Report that the emergency stop was pressed or released."""
        self._publish(self._statuses.emergency_stop(status, self.now_ns))

    def on_battery_status(self, status: BatteryStatus) -> None:
        """Report that the battery sends the robot home."""
        self._publish(self._statuses.battery(status, self.now_ns))

    def on_delivery_status(self, status: DeliveryStatus) -> None:
        """Report places that the robot failed to serve; what persons decide is no failure."""
        failures = tuple(filter(is_failure, status.skipped_reasons))
        status = msgspec.structs.replace(status, skipped_reasons=failures)
        self._publish(self._statuses.delivery(status, self.now_ns))

    def on_process_lost(self, process: String) -> None:
        """Report that a process does not respond."""
        self._publish(self._statuses.lost_process(process.data, self.now_ns))

    def on_process_back(self, _: String) -> None:
        """Report that it responds again."""
        self._publish(self._statuses.lost_process("", self.now_ns))

    def _publish(self, reports: list[Cause]) -> None:
        for report in reports:
            self._chains.people = self._people(report.header.stamp.ns)
            frame = self._lookup(report.header.frame_id or "map")
            cause = self._chains.process(report, frame, self._lookup("base_link"))
            if cause is not None:
                self.causes.publish(cause)

    def _people(self, now_ns: int) -> tuple[TrackedPoint, ...]:
        """Return the places of the people tracked at a time, in the frame map; none if the tracker is silent."""
        tracked = self.tracked_people.last
        if tracked is None or is_outdated(tracked, now_ns):
            return ()
        frame = self._lookup(tracked.header.frame_id)
        if frame is None or not tracked.people:
            return ()
        places = frame.apply(np.array([[one.position.x, one.position.y] for one in tracked.people]))
        return tuple(
            TrackedPoint(one.id, x, y) for one, (x, y) in zip(tracked.people, places.tolist(), strict=True)
        )

    def _lookup(self, frame: str) -> SE2 | None:
        try:
            return self.tf.lookup("map", frame)
        except TransformError:
            return None

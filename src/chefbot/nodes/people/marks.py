"""Clears marks of people who have moved on from a costmap."""

from __future__ import annotations

import math
from functools import cached_property

from chefbot.control.people_cost import NOBODY, NearbyPeople
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.sources import DROP_OFFS, LASTING_SOURCES
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.nodes.people.places import PeoplePlacesNode
from chefbot.people.people_messages import predicted_states
from chefbot.people.trails import BODY_RADIUS, PeopleTrails
from chefbot.runtime.transform_buffer import TransformError

MAX_AGE = 0.5
"""Age of the last message from which it does not say any more where people are, s."""


class PeopleMarksNode(PeoplePlacesNode):
    """Base class of a node with a costmap in which a person leaves no marks behind, and that knows who is around.

    The sensor that marked somebody may look elsewhere when the person leaves, and each clears its own marks only.
    That the same person is seen elsewhere shows that the place is free.
    """

    _costs: LayeredCostmap

    @cached_property
    def _trails(self) -> PeopleTrails:
        return PeopleTrails()

    def on_tracked_people(self, message: TrackedPeople) -> None:
        """Clear the marks where people were seen who are elsewhere now."""
        places = self._trails.left(message)
        if not len(places):
            return
        try:
            frame = self.tf.lookup(self.fixed_frame, message.header.frame_id)
        except TransformError:
            return  # not localized: the costmap has no marks
        self._costs.clear_discs(frame.apply(places), BODY_RADIUS, keep=(DROP_OFFS, *LASTING_SOURCES))

    def _nearby_people(self) -> NearbyPeople:
        """Return the people around in the frame of the costmap; none if the tracker is silent."""
        message, contact = self.tracked_people.last, self.robot.circumscribed_radius + BODY_RADIUS
        age = (self.now_ns - message.header.stamp.ns) / 1e9 if message is not None else math.inf
        if message is None or not 0.0 <= age <= MAX_AGE:
            return NOBODY
        try:
            frame = self.tf.lookup(self.fixed_frame, message.header.frame_id)
        except TransformError:
            return NOBODY  # not localized
        return NearbyPeople(predicted_states(message, age, frame), contact)

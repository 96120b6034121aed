"""The places of the tracked people, in the frame of a node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.people.people_messages import is_outdated
from chefbot.runtime.node import In, Node
from chefbot.runtime.transform_buffer import TransformError


class PeoplePlacesNode(Node):
    """Base class of a node that knows where people are; `fixed_frame` is the frame of their places."""

    fixed_frame = "odom"
    tracked_people: In[TrackedPeople]

    def _people(self) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
        """Return numbers (n,) and places (n, 2) of the people who are tracked now, m."""
        tracked = self.tracked_people.last
        nobody = np.empty(0, np.uint32), np.empty((0, 2))
        if tracked is None or not tracked.people or is_outdated(tracked, self.now_ns):
            return nobody
        try:
            frame = self.tf.lookup(self.fixed_frame, tracked.header.frame_id)
        except TransformError:
            return nobody
        places = np.array([[one.position.x, one.position.y] for one in tracked.people])
        return np.array([one.id for one in tracked.people], np.uint32), frame.apply(places)

"""Discounting of correlated scans while several poses are possible.

Scans from one viewpoint are not independent: they see the same surfaces and share the errors of the map, such as
furniture that was moved, and walls that lie between two cells. If each were weighed as independent evidence, a robot
that turns in place would soon be sure which of two equal rooms it is in. So all scans from one viewpoint together
weigh as much as a part of one scan, and motion to another viewpoint allows for more (a power of the likelihood below
one, as for the beams of a scan in Probabilistic Robotics, 6.3.4, but here over time).
"""

from __future__ import annotations

import math

from chefbot.maths.se2 import SE2

EVIDENCE_PER_VIEWPOINT = 0.4
"""Weight that all scans from one viewpoint have together, as a share of the weight of one independent scan."""
NEW_VIEWPOINT_DISTANCE = 1.0
"""Distance after which scans are of another viewpoint, and independent of those before, m."""
FULL_VIEW = 0.9 * 2.0 * math.pi
"""Field of view from which on rotating in place shows nothing new, rad."""


class ViewEvidence:
    """The evidence that scans from the present viewpoint may still contribute, as a share of one scan's evidence.

    Each scan uses some of it up (`use`), and motion renews it (`move`).
    """

    def __init__(self) -> None:
        self.left = EVIDENCE_PER_VIEWPOINT

    def move(self, motion: SE2, field_of_view: float) -> None:
        """Renew the evidence by how much of what a motion brings into view the scans before did not show.

        field_of_view: of these scans, rad; a narrow one shows something new after a rotation as well.
        """
        new = math.hypot(motion.x, motion.y) / NEW_VIEWPOINT_DISTANCE
        if field_of_view < FULL_VIEW:
            new += abs(motion.yaw) / max(field_of_view, 1e-3)
        self.left = min(EVIDENCE_PER_VIEWPOINT, self.left + new * EVIDENCE_PER_VIEWPOINT)

    def use(self, share: float) -> None:
        """Use up the share of a scan's evidence that was applied to the particles."""
        self.left = max(0.0, self.left - share)

"""How much evidence the scans from one place are, while several places are possible.

Scans of the same surfaces share the errors of the map: furniture that was moved, walls that lie between two cells.
If each were independent evidence, a robot that turns in place would soon be sure which of two equal rooms it is in.
So all scans of one view count as one, and motion adds new views (a power of the likelihood below one as in
Probabilistic Robotics, 6.3.4, here over time).
"""

from __future__ import annotations

import math

from chefbot.maths.se2 import SE2

EVIDENCE_OF_A_VIEW = 0.4
"""Share of a scan's evidence that all scans of one view have together."""
NEW_VIEW_DISTANCE = 1.0
"""Distance after which a view is another one, m."""
FULL_VIEW = 0.9 * 2.0 * math.pi
"""Field of view from which on rotating in place shows nothing new, rad."""


class ViewEvidence:
    """The share of a scan's evidence that is left for the present view; motion renews it."""

    def __init__(self) -> None:
        self.left = EVIDENCE_OF_A_VIEW

    def move(self, motion: SE2, field_of_view: float) -> None:
        """Add what a motion shows that the scans before, with a field of view (rad), have not."""
        new = math.hypot(motion.x, motion.y) / NEW_VIEW_DISTANCE
        if field_of_view < FULL_VIEW:
            new += abs(motion.yaw) / max(field_of_view, 1e-3)
        self.left = min(EVIDENCE_OF_A_VIEW, self.left + new * EVIDENCE_OF_A_VIEW)

    def use(self, share: float) -> None:
        """Take away what a scan was used for."""
        self.left = max(0.0, self.left - share)

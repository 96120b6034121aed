"""Progress of the navigation to a goal: state, feedback and its rate. Times are in ns."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import FollowPath_Feedback, NavigateToPose_Feedback
from chefbot.msgs.std_msgs import Header

ACTIVE_STATES = ("driving", "recovering")
"""States in which the controller is active."""
FEEDBACK_PERIOD_NS = 500_000_000
"""Minimum time between two feedback messages, ns."""
MIN_SPEED_FOR_ETA = 0.01
"""Speed below which the estimated time remaining is reported as 0, m/s, as Nav2 does."""


class NavigationState:
    """State of the navigator, and the reason why it last stopped."""

    def __init__(self) -> None:
        self.state = self.reason = ""

    @property
    def is_active(self) -> bool:
        """Whether the controller is active."""
        return self.state in ACTIVE_STATES

    def message(self, now_ns: int, recoveries: int, waiting_reason: str, limit: str) -> NavigationStatus:
        """Return the status to publish; while the controller waits, the state is `waiting` with its reason.

        limit: why the collision monitor limits the motion, which counts while the robot drives.
        """
        waits = bool(waiting_reason) and self.is_active
        state, reason = ("waiting", waiting_reason) if waits else (self.state, self.reason)
        reason = reason or (limit if self.is_active else "")
        return NavigationStatus(Header.of(now_ns, "map"), state, recoveries, reason)


class NavigationProgress:
    """Calculates the feedback of a goal from the controller's feedback, at a limited rate."""

    def __init__(self) -> None:
        self._path_feedback = FollowPath_Feedback()
        self._start_ns = self._feedback_ns = 0

    def restart(self, now_ns: int) -> None:
        """Start the time of a new goal."""
        self._path_feedback, self._start_ns = FollowPath_Feedback(), now_ns

    def process(self, feedback: FollowPath_Feedback, now_ns: int) -> bool:
        """Process the controller's feedback; return whether the goal's next feedback is due."""
        self._path_feedback = feedback
        return now_ns - self._feedback_ns >= FEEDBACK_PERIOD_NS

    def feedback(self, now_ns: int, pose: PoseStamped, recoveries: int) -> NavigateToPose_Feedback:
        """Return the feedback to publish now, with the robot's pose on the map."""
        self._feedback_ns = now_ns
        distance, speed = self._path_feedback.distance_to_goal, self._path_feedback.speed
        remaining = Duration.of(distance / speed) if speed > MIN_SPEED_FOR_ETA else Duration()
        elapsed = Duration.of((now_ns - self._start_ns) / 1e9)
        return NavigateToPose_Feedback(pose, elapsed, remaining, recoveries, distance)

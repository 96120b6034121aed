"""Contacts with obstacles that no sensor sees, which the costmaps mark."""

from __future__ import annotations

from chefbot.control.contact_detector import ContactDetector
from chefbot.control.path_follower import FollowPathError, PathStep, failed_path
from chefbot.control.slip_detector import SlipDetector
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import PoseStamped, Twist
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.runtime.node import In, Out, topic

SLIPPING = (
    "The wheels turn, but the scans show that the robot stands: something holds it that no sensor sees, or the "
    "wheels have no grip."
)


class ContactsNode(LocalCostmapNode):
    """Base class of a node that follows paths and publishes where the robot touches something unseen."""

    cmd_vel: In[Twist]
    contact_out: Out[PoseStamped] = topic("contact")

    def start(self) -> None:
        """Create the detectors of contacts for a robot that stands."""
        super().start()
        self._contacts = ContactDetector()
        self._slip = SlipDetector()
        self._slipping_since_ns: int | None = None

    def on_cmd_vel(self, twist: Twist) -> None:
        """Take the twist that the base commands."""
        self._contacts.process(twist.linear.x, twist.angular.z, self.now_ns)

    def _mark_laser(self, scan: LaserScan, pose: SE2) -> None:
        super()._mark_laser(scan, pose)
        if not self.is_active:
            return
        robot = self.tf.lookup("odom", "base_link", scan.header.stamp.ns)
        self._slip.process(scan, robot, robot.between(pose))

    def _ended_by_slip(self, step: PathStep) -> PathStep:
        """Return the step with a failure as its result if the wheels slip."""
        if step.result is not None or not self._slip.is_slipping:
            return step
        self._slipping_since_ns = self._slip.standing_since_ns
        self._slip.reset()
        return step._replace(result=failed_path(FollowPathError.STUCK, SLIPPING))

    def publish_contact_if_driven(self) -> None:
        """Publish a contact if one explains that the robot makes no progress on a free path.

        Its stamp is from before the wheels slipped, when the odometry still had the pose at which the robot stands.
        """
        since_ns, self._slipping_since_ns = self._slipping_since_ns, None
        if self._contacts.explains(self._base_fault, self.now_ns):
            stamp_ns = self.now_ns if since_ns is None else since_ns
            self.contact_out.publish(PoseStamped(Header.of(stamp_ns, "base_link")))

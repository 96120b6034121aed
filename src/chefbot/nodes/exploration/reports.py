"""What an exploration reports, and its wait while the robot itself cannot drive."""

from __future__ import annotations

from chefbot.exploration.session import NOTHING_DECIDED, WAITS, ExplorationSession, exploration_status
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.msgs.std_msgs import String
from chefbot.nodes.causes.base_fault import BaseFaultNode
from chefbot.nodes.exploration.frontier_map import FrontierMapNode
from chefbot.runtime.node import Out, topic

FAULT_PATIENCE = 300.0
"""Time for which an exploration waits for a fault of the robot to end, s."""
POLL_PERIOD = 2.0
"""Period at which the fault is looked at, s."""


class RobotFaultError(Exception):
    """The robot could not drive for too long; the text is the fault."""


class ExplorationReportsNode(FrontierMapNode, BaseFaultNode):
    """Base class of a node that explores: it publishes progress and result, and pauses during a fault of the robot.

    A goal that fails because a sensor or the motor board has a fault shows nothing about its frontier.
    """

    exploration_status: Out[ExplorationStatus] = topic(latched=True)
    notice: Out[String] = topic("explorer/notice")

    def start(self) -> None:
        """Start a session in which nothing is decided."""
        super().start()
        self._session = ExplorationSession()

    async def _await_end_of_fault(self) -> None:
        """Wait until the robot can drive again; raise RobotFaultError if it cannot for too long."""
        until_ns = self.now_ns + round(FAULT_PATIENCE * 1e9)
        self._publish_progress(WAITS + self._base_fault)
        while fault := self._base_fault:
            if self.now_ns >= until_ns:
                raise RobotFaultError(fault)
            await self.sleep(POLL_PERIOD)

    def _publish_progress(self, sentence: str) -> None:
        self._publish(False, sentence)

    def _publish_end(self, sentence: str) -> None:
        """Publish that an exploration has ended, also for who watches the terminal."""
        self._publish(True, sentence)
        self.notice.publish(String(sentence))

    def _publish_idle(self, sentence: str) -> None:
        """Publish the state of a node that does not explore."""
        self._session.decision = NOTHING_DECIDED
        self._publish(True, sentence)

    def _publish(self, done: bool, sentence: str) -> None:
        status = exploration_status(
            self.now_ns, done=done, decision=self._session.decision, sentence=sentence
        )
        self.exploration_status.publish(status)

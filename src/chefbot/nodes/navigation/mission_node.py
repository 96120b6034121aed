"""A node that carries out a mission and publishes what it does as a sentence on `phase`."""

from __future__ import annotations

from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Node, Out

OUTCOME_TIME = 30.0
"""Time for which the outcome of a mission is shown, s; afterwards it is no longer what the robot does."""


class MissionNode(Node):
    """Publishes sentences on `phase` when they change; an outcome is followed by an empty one after a while."""

    phase: Out[String]

    def start(self) -> None:
        """Start the node without a mission."""
        super().start()
        self._sentence = ""

    def _publish_phase(self, sentence: str) -> None:
        if sentence != self._sentence:
            self._sentence = sentence
            self.phase.publish(String(sentence))

    def _publish_outcome(self, sentence: str) -> None:
        self._publish_phase(sentence)
        self.spawn(self._clear(sentence))

    async def _clear(self, outcome: str) -> None:
        await self.sleep(OUTCOME_TIME)
        if self._sentence == outcome:
            self._publish_phase("")

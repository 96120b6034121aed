"""One tracked person, and the evidence that it is one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from chefbot.people.candidates import Measurement
from chefbot.people.motion_model import MotionState, propagate

TENTATIVE_ID = 0
"""Id of a track that is not known to be a person yet."""
CONFIRMED_EVIDENCE, LIKELY_EVIDENCE, REFUTED_EVIDENCE, MAX_EVIDENCE = 3.0, 0.5, -1.5, 6.0
"""Evidence (log odds) from which a track is a person, and may be one; below which it ends; and its bound."""
(
    NOVEL_EVIDENCE,
    MOVING_EVIDENCE,
    PAIR_EVIDENCE,
    BODY_EVIDENCE,
    LEG_EVIDENCE,
    STILL_EVIDENCE,
    ON_MAP_EVIDENCE,
) = 1.0, 0.45, 0.12, 0.06, 0.04, -0.05, -1.0
"""Evidence of a measurement: where nothing was before; of a track that moves; of two legs; as wide as two legs; as
wide as one; none of these; on an obstacle of the map."""
FREE_EVIDENCE = -0.8
"""Evidence of an observation that shows a track's place to be free."""
MIN_MEASUREMENTS = 4
"""Measurements before a track is a person."""
MOVING_SPEED = 0.3
"""Speed from which a track moves, m/s."""
MOVED_DISTANCE = 0.35
"""Distance from the first measurement from which a track moves, m."""
STANDING_SPEED, STANDING_TIME = 0.2, 1.0
"""Speed below which a person stands, m/s, once it has lasted for this time, s."""
INITIAL_SPEED = 0.8
"""Standard deviation of a new track's velocity along each axis, m/s."""
UNSEEN_DECAY, UNSEEN_DELAY = 1.5, 0.35
"""Time constant with which the velocity of a person who is not seen decays, s, and the time until that begins."""
MAX_SPEED = 3.0
"""Speed that no person in a building has, m/s."""
VISIBLE_TIME = 0.5
"""Time since the last measurement for which a person counts as visible, s."""


class Sighting(NamedTuple):
    """Where and when (m, s) a person was seen."""

    x: float
    y: float
    time: float


@dataclass(slots=True)
class PersonTrack:
    """A confirmed track, a person, or a tentative one.

    id: number of the person, above 0, TENTATIVE_ID before it is one. state: at `time`, s. evidence: log odds that it
    is a person. first, last_seen: first and last measurement. measurements: their number. standing_since: time since
    which it has been slow, s; inf while it moves.
    """

    id: int
    state: MotionState
    time: float
    first: Sighting
    last_seen: Sighting
    evidence: float = 0.0
    measurements: int = 1
    standing_since: float = math.inf

    @property
    def confirmed(self) -> bool:
        """Whether it is known to be a person."""
        return self.id != TENTATIVE_ID

    @property
    def confidence(self) -> float:
        """Probability that it is a person, 0 to 1."""
        return 1.0 / (1.0 + math.exp(-self.evidence))

    @property
    def likely(self) -> bool:
        """Whether it is a person or may well be one, so that its returns are not background."""
        return self.confirmed or self.evidence > LIKELY_EVIDENCE

    @property
    def standing(self) -> bool:
        """Whether the person has been slow for STANDING_TIME."""
        return self.time - self.standing_since >= STANDING_TIME

    @property
    def visible(self) -> bool:
        """Whether the person was seen just now."""
        return self.time - self.last_seen.time <= VISIBLE_TIME

    def advance(self, time: float, density: float) -> None:
        """Propagate the state to a later time, s."""
        unseen = time - self.last_seen.time > UNSEEN_DELAY
        decay = UNSEEN_DECAY if unseen else math.inf
        self.state = propagate(self.state, time - self.time, density, decay)
        self.time = max(time, self.time)

    def take(self, state: MotionState, seen: Measurement) -> None:
        """Set the state after a measurement and add its evidence."""
        self.state = state
        self.last_seen = Sighting(seen.x, seen.y, self.time)
        self.measurements += 1
        if state.speed > STANDING_SPEED:
            self.standing_since = math.inf
        elif math.isinf(self.standing_since):
            self.standing_since = self.time
        self.add_evidence(self._evidence_of(seen))

    def add_evidence(self, evidence: float) -> None:
        """Add evidence that it is a person."""
        self.evidence = min(self.evidence + evidence, MAX_EVIDENCE)

    def _evidence_of(self, seen: Measurement) -> float:
        if seen.on_map or self.state.speed > MAX_SPEED:
            return ON_MAP_EVIDENCE
        evidence = NOVEL_EVIDENCE if seen.novel else 0.0
        evidence += MOVING_EVIDENCE if self._moves() else 0.0
        evidence += (
            PAIR_EVIDENCE if seen.pair else BODY_EVIDENCE if seen.body else LEG_EVIDENCE if seen.leg else 0.0
        )
        return evidence if evidence > 0.0 else STILL_EVIDENCE

    def _moves(self) -> bool:
        """Return whether it certainly moves."""
        state = self.state
        sure = state.speed > max(MOVING_SPEED, 2.0 * math.sqrt(state.speed_variance))
        return sure and state.distance(self.first.x, self.first.y) > MOVED_DISTANCE

    @property
    def over(self) -> bool:
        """Whether the evidence is against a person."""
        return self.evidence <= REFUTED_EVIDENCE or (
            not self.confirmed and self.evidence <= 0.5 * REFUTED_EVIDENCE
        )

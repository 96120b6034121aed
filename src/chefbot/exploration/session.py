"""The course of an exploration: turns to look around, the end when no frontier is left, and the status."""

from __future__ import annotations

import math

from chefbot.exploration.explorer import FULL_TURN, ExplorationDecision, ExplorationGoal, SkippedFrontier
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.msgs.nav2_msgs import Spin_Goal
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

EMPTY_MAPS_TO_FINISH = 2
"""Consecutive maps without a frontier that end the exploration: the last scans may not be in the map yet."""
ENCLOSED_MAPS_TO_FINISH = 15
"""The same, half a minute, if obstacles enclose the robot: they may be people who go on."""
SAME_PLACE = 1.0
"""Distance up to which frontiers count as one place in a sentence, m."""
MAX_LISTED = 3
"""Maximum number of places in a sentence; the status lists all frontiers."""
WAITS = "Exploration waits: "
"""Beginning of the sentence of a status while the robot itself cannot drive; the fault follows."""
ENCLOSED = "obstacles enclose the robot."
"""Clause of a status while no floor around the robot is reachable."""
NOTHING_DECIDED = ExplorationDecision(None, ())
"""Decision before the first map."""


class ExplorationSession:
    """Keeps the state of an exploration between two maps; `decision` is the latest one."""

    def __init__(self) -> None:
        self.decision = NOTHING_DECIDED
        self._turn = -FULL_TURN
        self._empty_maps = 0

    @property
    def is_complete(self) -> bool:
        """Whether no goal was left on enough maps in a row."""
        return self._empty_maps >= (
            ENCLOSED_MAPS_TO_FINISH if self.decision.enclosed else EMPTY_MAPS_TO_FINISH
        )

    @property
    def progress(self) -> str:
        """The sentence that reports the state of the exploration after the latest decision."""
        return WAITS + ENCLOSED if self.decision.enclosed else "Exploring."

    @property
    def result(self) -> str:
        """The sentence that reports how the exploration ends with the latest decision."""
        return _result_sentence(self.decision)

    def process(self, decision: ExplorationDecision) -> ExplorationGoal | None:
        """Process the decision on a new map and return the goal to visit, None to wait for another map."""
        self.decision = decision
        self._empty_maps = self._empty_maps + 1 if decision.goal is None else 0
        return decision.goal

    def next_turn(self) -> Spin_Goal:
        """Return a full turn, alternately left and right, so that the scale errors of the heading cancel."""
        self._turn = -self._turn
        return Spin_Goal(self._turn, Duration.of(30.0))


def field_of_view(robot: Robot) -> float:
    """Return the field of view of the robot's mapping sensor, rad."""
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    return 2.0 * math.pi if sensor is None else sensor.field_of_view


def _result_sentence(decision: ExplorationDecision) -> str:
    """Return how an exploration ended: with all that is within reach seen, or where attempts failed."""
    if decision.enclosed:
        return f"Not everything is seen: {ENCLOSED}"
    apart: list[SkippedFrontier] = []
    for frontier in sorted(decision.skipped, key=lambda frontier: -frontier.length):
        if frontier.failed and all(_distance(frontier, other) > SAME_PLACE for other in apart):
            apart.append(frontier)
    if not apart:
        return "Everything within reach is seen."
    places = ", ".join(f"({frontier.x:.1f}, {frontier.y:.1f})" for frontier in apart[:MAX_LISTED])
    return f"Not everything is seen: all attempts failed near {places}."


def _distance(frontier: SkippedFrontier, other: SkippedFrontier) -> float:
    return math.hypot(frontier.x - other.x, frontier.y - other.y)


def exploration_status(
    now_ns: int, *, done: bool, decision: ExplorationDecision, sentence: str
) -> ExplorationStatus:
    """Return the status to publish, with the skipped frontiers of a decision and their reasons."""
    remaining = tuple(
        f"({frontier.x:.1f}, {frontier.y:.1f}) {frontier.length:.1f} m: {frontier.reason}"
        for frontier in decision.skipped
    )
    return ExplorationStatus(Header.of(now_ns, "map"), done, len(remaining), sentence, remaining)

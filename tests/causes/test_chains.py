"""Chains of causes: what is behind a report, what its obstacle is, and the sentence of it all."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from chefbot.causes.chains import (
    LINK_NS,
    MAP_REACH,
    MAX_KEPT,
    PERSON_REACH,
    CauseChains,
    TrackedPoint,
    is_mapped,
)
from chefbot.causes.reports import CONTACT, DETOUR, END, FAILURE, MAP, STOP, MarkedPlace, make_report, stamped
from chefbot.causes.sentences import after_colon, joined
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import Cause

SECOND = 1_000_000_000
ROBOT = SE2(1.0, 1.0, 0.0)


def map_with_a_wall() -> Grid:
    cells = np.zeros((100, 100), np.int8)
    cells[:, 60] = 100
    return Grid(cells, 0.05, 0.0, 0.0)


def blocked(x: float, y: float = 1.0, sensor: str = "lidar", marked_ns: int = SECOND) -> Cause:
    return make_report(STOP, "twists", "No command.", MarkedPlace(sensor, "map", x, y, marked_ns))


def process(chains: CauseChains, report: Cause, node: str = "controller", now_ns: int = SECOND) -> Cause:
    cause = chains.process(stamped(report, node, now_ns), IDENTITY, ROBOT)
    assert cause is not None
    return cause


def test_the_static_map_distinguishes_walls_from_what_came_later() -> None:
    chains = CauseChains()
    assert process(chains, blocked(3.02)).obstacle == ""  # no map yet
    chains.set_map(map_with_a_wall())
    wall, other = process(chains, blocked(3.02)), process(chains, blocked(2.0))
    assert (wall.obstacle, wall.id) == ("on the map", 2)
    assert (other.obstacle, other.person) == ("not on the map", -1)
    assert other.sentence == (
        "No command. The lidar marked an obstacle that is not on the map at x 2.00 m, y 1.00 m."
    )
    assert other.chain == (
        "controller: twists",
        "lidar: x 2.00 m, y 1.00 m, marked at 1.00 s",
        "obstacle: not on the map",
    )


def test_a_place_near_a_wall_of_the_map_is_the_wall() -> None:
    grid = map_with_a_wall()
    assert is_mapped(grid, 3.025 - 0.9 * MAP_REACH, 2.0) and not is_mapped(grid, 3.025 - 1.5 * MAP_REACH, 2.0)
    assert not is_mapped(grid, -3.0, 2.0) and not is_mapped(grid, 50.0, 50.0)


def test_the_nearest_tracked_person_is_named() -> None:
    chains = CauseChains()
    chains.set_map(map_with_a_wall())
    chains.people = [TrackedPoint(3, 2.1, 1.0), TrackedPoint(7, 2.4, 1.0)]
    cause = process(chains, blocked(2.0))
    assert (cause.obstacle, cause.person) == ("person", 3)
    assert "The lidar marked person 3 at" in cause.sentence and cause.chain[-1] == "obstacle: person 3"
    assert process(chains, blocked(2.4 + 1.1 * PERSON_REACH)).person == -1


def test_a_recovery_has_the_place_of_what_blocked_the_controller() -> None:
    chains = CauseChains()
    base = process(chains, make_report(STOP, "monitor", "Stopped: it is near."), "base")
    stop = process(chains, blocked(2.0))
    recovery = process(chains, make_report(STOP, "recovery", "Recovery 1: no command."), "navigator")
    assert (recovery.caused_by, recovery.point, recovery.sensor) == (stop.id, stop.point, "lidar")
    assert recovery.chain == ("navigator: recovery", *stop.chain)
    assert recovery.sentence.startswith("Recovery 1: no command. The lidar marked")
    assert base.caused_by == 0 and stop.caused_by == 0


def test_a_failure_of_the_planner_comes_before_a_stop() -> None:
    chains = CauseChains()
    process(chains, blocked(2.0))
    plan = process(chains, msgspec.structs.replace(blocked(4.0), kind=FAILURE), "planner")
    recovery = process(chains, make_report(STOP, "recovery", "Recovery 1: x."), "navigator", SECOND + LINK_NS)
    assert recovery.caused_by == plan.id
    late = process(chains, make_report(STOP, "recovery", "Recovery 2: x."), "navigator", SECOND + LINK_NS + 1)
    assert late.caused_by == 1  # the stop still holds


def test_what_ended_long_ago_is_not_behind_anything() -> None:
    chains = CauseChains()
    stop = stamped(blocked(2.0), "controller", SECOND)
    chains.process(stop, IDENTITY, ROBOT)
    ended = chains.process(
        stamped(msgspec.structs.replace(stop, kind=END), "controller", 4 * SECOND), IDENTITY, ROBOT
    )
    assert ended is not None and ended.id == 1 and ended.numbers[0].value == pytest.approx(3.0)
    assert ended.sentence.startswith("Ended after 3.0 s: No command.")
    recovery = make_report(STOP, "recovery", "Recovery 1: x.")
    assert process(chains, recovery, "navigator", 4 * SECOND + LINK_NS).caused_by == 1
    alone = process(chains, recovery, "navigator", 4 * SECOND + LINK_NS + 1)
    assert alone.caused_by == 0 and alone.chain == ("navigator: recovery",) and not alone.located


def test_a_check_that_names_its_root_has_nothing_behind_it() -> None:
    chains = CauseChains()
    process(chains, blocked(2.0))
    lost = process(chains, make_report(STOP, "localization", "Recovery 1: Localization lost."), "navigator")
    assert lost.caused_by == 0 and lost.sentence == "Recovery 1: Localization lost."


def test_lost_ends_follow_from_the_checks_that_find_something() -> None:
    chains = CauseChains()
    first, second = process(chains, blocked(2.0)), process(chains, blocked(1.0), now_ns=3 * SECOND)
    other = process(chains, blocked(1.0), node="base", now_ns=3 * SECOND)
    failure = process(chains, make_report(FAILURE, "global plan", "No path."), now_ns=3 * SECOND)
    assert chains.lost_ends("controller", ("twists", "twists"), 9 * SECOND) == []
    [end] = chains.lost_ends("controller", ("twists",), 9 * SECOND)
    assert (end.id, end.kind, end.header.stamp.ns) == (first.id, END, 9 * SECOND)
    assert chains.lost_ends("controller", (), 4 * SECOND) == [], "its report may be on the way"
    assert chains.present == [second.id, other.id]
    assert [end.id for end in chains.lost_ends("controller", (), 9 * SECOND)] == [second.id]
    assert chains.present == [other.id] and failure.id > other.id, "a failure does not last"


def test_an_end_of_what_never_began_is_nothing() -> None:
    assert CauseChains().process(stamped(make_report(END, "x", ""), "base", 1), IDENTITY, ROBOT) is None


def test_a_place_in_odom_is_moved_to_the_map() -> None:
    chains = CauseChains()
    report = make_report(DETOUR, "local path", "Aside.", MarkedPlace("lidar", "odom", 1.0, 0.0, 0))
    cause = chains.process(stamped(report, "controller", 1), SE2(2.0, 0.0, np.pi / 2), ROBOT)
    assert cause is not None and cause.header.frame_id == "map" and cause.robot.se2 == ROBOT
    assert (cause.point.x, cause.point.y) == pytest.approx((2.0, 1.0))
    unknown = chains.process(stamped(report, "controller", 1), None, None)
    assert unknown is not None and unknown.header.frame_id == "odom" and unknown.obstacle == ""
    assert " m in odom" in unknown.sentence and " in " not in cause.sentence


def test_old_marks_contacts_and_the_map_have_their_own_sentences() -> None:
    chains = CauseChains()
    old = process(chains, blocked(2.0, marked_ns=SECOND), now_ns=61 * SECOND)
    assert old.sentence.endswith("y 1.00 m, 60.0 s earlier.")
    assert "The robot touched an obstacle" in process(chains, blocked(2.0, sensor=CONTACT)).sentence
    assert "The map has an obstacle" in process(chains, blocked(2.0, sensor=MAP, marked_ns=0)).sentence
    assert "in its cone" in process(chains, blocked(2.0, sensor="ultrasonic ranger")).sentence


def test_a_long_run_takes_no_more_memory() -> None:
    chains = CauseChains()
    for _ in range(3 * MAX_KEPT):
        process(chains, blocked(2.0))
    assert len(chains._kept) == MAX_KEPT


def test_what_two_sentences_share_stands_once() -> None:
    assert joined("Recovery 1: no path.", "No path. The lidar.") == "Recovery 1: no path. The lidar."
    assert joined("Not served", "No path.") == "Not served. No path."


@pytest.mark.parametrize(
    "name", ["STOP is pressed.", "SLAM is lost.", "Nav2 refused it.", "table 3: no.", ""]
)
def test_a_name_keeps_its_capitals_after_a_colon(name: str) -> None:
    assert after_colon(name) == name
    assert after_colon("A person stands there.") == "a person stands there."
    assert after_colon("The path is blocked.") == "the path is blocked."


def test_a_zone_is_named_and_is_not_an_obstacle_of_the_map() -> None:
    chains = CauseChains()
    chains.set_map(map_with_a_wall())
    chains.people = (TrackedPoint(4, 3.0, 1.0),)
    cause = process(chains, blocked(3.02, sensor="keep-out zone stairs", marked_ns=0))
    assert (cause.obstacle, cause.person) == ("", -1)
    assert cause.sentence == "No command. The keep-out zone stairs lies at x 3.02 m, y 1.00 m."
    assert cause.chain[-1] == "keep-out zone stairs: x 3.02 m, y 1.00 m"

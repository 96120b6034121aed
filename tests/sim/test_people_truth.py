"""The true poses of people, for scoring."""

from __future__ import annotations

from itertools import pairwise

import pytest

from chefbot.launcher.session import session, start
from chefbot.msgs.geometry_msgs import PoseArray
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication

ARGUMENTS = {"world": "room", "wire": "off", "headless": "true"}


def true_poses(people: int) -> list[PoseArray]:
    """Return the true poses of people in the first two seconds in the room."""
    accepted = load_launch("gmapping_demo").args
    arguments = {**ARGUMENTS, "people": str(people)}
    launch = load_launch("gmapping_demo", {k: v for k, v in arguments.items() if k in accepted})
    found: list[PoseArray] = []

    def note(publication: Publication) -> None:
        if publication.topic == "ground_truth/people" and isinstance(publication.message, PoseArray):
            found.append(publication.message)

    with session(load_robot("chefbot_lidar"), 1, "simulation", 0.0, None) as system:
        system.loop.add_observer(note)
        start(system, launch)
        system.loop.run(until_ns=2_000_000_000)
    return found


@pytest.mark.parametrize("people", [0, 3])
def test_everybody_is_published_where_they_are(people: int) -> None:
    found = true_poses(people)
    assert all(len(message.poses) == people for message in found)
    assert bool(found) is (people > 0)
    # people walk: nobody jumps between two messages, and somebody has moved
    for one, other in pairwise(found):
        steps = [a.se2.distance(b.se2) for a, b in zip(one.poses, other.poses, strict=True)]
        assert max(steps) < 0.3
    if found:
        moved = [a.se2.distance(b.se2) for a, b in zip(found[0].poses, found[-1].poses, strict=True)]
        assert max(moved) > 0.1

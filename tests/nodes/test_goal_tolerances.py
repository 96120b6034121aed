"""The tolerances of a goal are those of the place at which its path ends."""

from __future__ import annotations

import math
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.control.controller import ControllerStatus
from chefbot.control.goal_checkers import GoalParams
from chefbot.control.path_follower import PathFollower
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import Place, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.navigation.goal_tolerances import SAME_POSE_TOLERANCE, GoalTolerancesNode
from chefbot.runtime.node import NoParams

DOCK, TABLE, KITCHEN = SE2(2.0, 1.0, math.pi), SE2(4.0, 1.0, 0.0), SE2(0.0, 3.0, 1.0)


class Follower(GoalTolerancesNode):
    """A node that a test queries for tolerances."""

    params: NoParams


@pytest.fixture
def node() -> Any:
    runner = NodeRunner({"one": f"{__name__}:Follower"}, {})
    found: Any = runner.system.nodes["one"]
    found.runner = runner
    return found


def publish_places(node: Any) -> None:
    def place(name: str, at: SE2, **tolerances: float) -> Place:
        return Place(name, PoseStamped(Header.of(0, "map"), Pose.of(at)), **tolerances)

    places = (
        place("dock", DOCK, xy_tolerance=0.02, yaw_tolerance=0.03),
        place("table", TABLE, yaw_tolerance=0.5),
        place("kitchen", KITCHEN),
    )
    node.runner.loop.publish("places", Places(places), "map_server")
    node.runner.run(0.0)


def path_to(*poses: SE2, frame: str = "map") -> Path:
    header = Header.of(0, frame)
    return Path(header, tuple(PoseStamped(header, Pose.of(pose)) for pose in poses))


def test_a_place_gives_its_tolerances_to_paths_that_end_there(node: Any) -> None:
    publish_places(node)
    assert node._tolerance_of(path_to(TABLE, DOCK)) == GoalParams(xy_tolerance=0.02, yaw_tolerance=0.03)
    assert node._tolerance_of(path_to(DOCK, KITCHEN)) is None, "it only leads past"


def test_a_place_without_tolerances_has_the_defaults(node: Any) -> None:
    publish_places(node)
    assert node._tolerance_of(path_to(TABLE)) == GoalParams(yaw_tolerance=0.5)
    assert node._tolerance_of(path_to(KITCHEN)) is None


@pytest.mark.parametrize(
    ("offset", "same"),
    [
        (SE2(0.9 * SAME_POSE_TOLERANCE, 0.0, 0.0), True),
        (SE2(0.0, 1.1 * SAME_POSE_TOLERANCE, 0.0), False),
        (SE2(0.0, 0.0, 0.9 * SAME_POSE_TOLERANCE), True),  # beyond pi
        (SE2(0.0, 0.0, -1.1 * SAME_POSE_TOLERANCE), False),
        (SE2(0.0, 0.0, 2.0 * math.pi), True),
    ],
)
def test_a_goal_beside_a_place_is_another_one(node: Any, offset: SE2, same: bool) -> None:
    publish_places(node)
    goal = SE2(DOCK.x + offset.x, DOCK.y + offset.y, DOCK.yaw + offset.yaw)
    assert (node._tolerance_of(path_to(goal)) is not None) == same


def test_without_places_every_goal_is_as_usual(node: Any) -> None:
    node.places.last = None
    assert node._tolerance_of(path_to(DOCK)) is None


class Still:
    """A controller that stands."""

    def set_path(self, path: Any, *, same_goal: bool = False) -> None:
        """Follow none."""

    def command(self, *_: Any) -> Any:
        return 0.0, 0.0, ControllerStatus.RUNNING


def test_the_frame_of_the_path_follows_localization(node: Any) -> None:
    follower = PathFollower(Still(), lambda path, *_: path, 0.1)  # type: ignore[arg-type]
    node._tolerance_of(path_to(DOCK))
    node._place_goal(follower)
    assert follower.frame == IDENTITY, "not localized yet: it keeps the last one"
    for correction in (SE2(0.3, 0.0, 0.1), SE2(0.5, -0.1, 0.2)):
        stamped = TransformStamped.of(node.now_ns, "map", "odom", correction)
        node.runner.loop.publish("tf", TFMessage((stamped,)), "localization")
        node.runner.run(0.0)
        node._place_goal(follower)
        assert tuple(follower.frame) == pytest.approx(tuple(correction.inverse()))
    node._tolerance_of(path_to(DOCK, frame="odom"))
    node._place_goal(follower)
    assert follower.frame == IDENTITY

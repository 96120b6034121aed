"""The action that finds what blocks a path: people or an obstacle, the length of another path, and where to wait."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.planning.rooms import two_rooms
from tests.support.nodes import NodeRunner

from chefbot.costmap.params import GLOBAL_COSTMAP, CostmapParams
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapZone, MapZones
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.nodes.navigation.blockage_finder import BlockageFinderNode
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams

HERE, THERE, DOOR = SE2(1.0, 2.0, 0.0), SE2(6.5, 2.0, 0.0), 4.0
ODOM = SE2(1.0, 2.0, 0.0)
"""The frame odom in the map: where the robot stands."""


class FinderParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that a node with the costmap of the map must have."""

    costmap: CostmapParams = GLOBAL_COSTMAP
    settings: PlannerParams = PlannerParams()


class CustomPlanner:
    """A planner with the one method that a plugin must have."""

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        return GridPlanner().plan(costmap, start, goal)


class Finder(BlockageFinderNode):
    """The action alone."""

    params: FinderParams

    def start(self) -> None:
        super().start()
        self._planner = CustomPlanner()


class Rooms(NodeRunner):
    """Two rooms with a doorway of 1 m between them at x = 4; the robot stands in the left one."""

    def __init__(self, *, second_door: bool = False, localized: bool = True) -> None:
        super().__init__({"finder": f"{__name__}:Finder"}, {})
        self.node: Any = self.system.nodes["finder"]
        self.grid = two_rooms(door=1.0)
        if second_door:
            self.grid.cells[4:22, 80:84] = 0
        if localized:
            for parent, child, pose in (("map", "odom", ODOM), ("odom", "base_link", IDENTITY)):
                self.send("tf_static", TFMessage((TransformStamped.of(0, parent, child, pose),)))

    def send(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "test", from_device=True)
        self.run(0.0)

    def send_map(self, grid: Grid | None = None) -> None:
        self.send("map", OccupancyGrid.of(Header.of(0, "map"), grid or self.grid))

    def mark(self, *places: tuple[float, float], radius: float = 0.2) -> None:
        """Mark discs, at 4 s."""
        costs = self.node._costs
        costs.set_time(4.0)
        rows, columns = np.indices(costs.shape)
        for x, y in places:
            cx = costs.origin_x + (columns + 0.5) * 0.05 - x
            cy = costs.origin_y + (rows + 0.5) * 0.05 - y
            cells = np.nonzero(np.hypot(cx, cy) <= radius)
            costs.source_cells(LASER)[cells] = LETHAL
            costs.note_marks(LASER, cells)
        costs.note_all_changed()

    def track(self, *people: tuple[int, float, float], age: float = 0.0, frame: str = "map") -> None:
        stamp = Header.of(self.loop.now_ns - round(age * 1e9), frame)
        persons = tuple(TrackedPerson(number, Point(x, y)) for number, x, y in people)
        self.send("tracked_people", TrackedPeople(stamp, persons))

    def find(self, *, where: bool = False, goal: SE2 = THERE) -> FindBlockage_Result:
        request = FindBlockage_Goal(PoseStamped(Header.of(0, "map"), Pose.of(goal)), where)
        message = FindBlockage.send_goal(UUID(np.arange(16, dtype=np.uint8)), request)
        self.send("find_blockage/_action/send_goal", message)
        found: FindBlockage_Result = self.messages("find_blockage/_action/get_result")[-1].result
        return found


IN_DOOR = (DOOR - 0.05, 2.0)


def closed_door(**rooms: bool) -> Rooms:
    """Return rooms whose doorway is marked from side to side."""
    found = Rooms(**rooms)
    found.send_map()
    found.mark(*((DOOR, y) for y in np.arange(1.5, 2.55, 0.1)))
    return found


def test_a_free_path_is_not_blocked() -> None:
    rooms = Rooms()
    rooms.send_map()
    rooms.track((7, 1.0, 3.5))
    assert not rooms.find().blocked


@pytest.mark.parametrize("known", [{"localized": False}, {}])
def test_without_a_pose_or_a_map_nothing_is_found(known: dict[str, bool]) -> None:
    rooms = Rooms(**known)
    if known:
        rooms.send_map()
        rooms.mark(IN_DOOR)
    assert not rooms.find(where=True).blocked


def test_somebody_in_the_only_door_is_named_by_number() -> None:
    rooms = Rooms()
    rooms.send_map()
    rooms.mark(IN_DOOR, radius=0.25)
    rooms.track((4, 1.0, 3.5), (7, *IN_DOOR))
    found = rooms.find()
    assert found.blocked and found.people.tolist() == [7] and not found.alternative_path
    assert found.sensor == "lidar" and found.marked_at.ns == 4_000_000_000
    assert math.dist((found.point.x, found.point.y), IN_DOOR) < 0.35
    assert 2.0 < found.distance < 3.0 and found.extra_length == 0.0
    assert found.waiting_pose.header.frame_id == "", "none was requested"


def test_the_other_path_has_its_extra_length() -> None:
    rooms = Rooms(second_door=True)
    rooms.send_map()
    rooms.mark(IN_DOOR, radius=0.25)
    rooms.track((7, *IN_DOOR))
    found = rooms.find()
    assert found.blocked and found.alternative_path
    # over the middle of the other door, which begins 1.4 m further down
    longer = math.hypot(3.0, 1.3) + math.hypot(2.5, 1.3) - 5.5
    assert found.extra_length == pytest.approx(longer, abs=0.45)


def test_an_obstacle_that_closes_the_door_is_nobody() -> None:
    found = closed_door().find()
    assert found.blocked and found.people.tolist() == [] and not found.alternative_path
    assert not closed_door(second_door=True).find().blocked, "there is another path"


@pytest.mark.parametrize(
    ("age", "frame", "seen"),
    [(0.9, "map", True), (1.1, "map", False), (0.0, "odom", True), (0.0, "nowhere", False)],
)
def test_only_people_of_now_in_a_known_frame_count(age: float, frame: str, seen: bool) -> None:
    rooms = Rooms()
    rooms.run(2.0)
    rooms.send_map()
    rooms.mark(IN_DOOR, radius=0.25)
    x, y = IN_DOOR
    at = (x - ODOM.x, y - ODOM.y) if frame == "odom" else IN_DOOR
    rooms.track((7, *at), age=age, frame=frame)
    assert rooms.find().people.tolist() == ([7] if seen else [])


def test_the_place_to_wait_is_before_the_door_and_looks_at_it() -> None:
    rooms = Rooms()
    rooms.send_map()
    rooms.mark(IN_DOOR, radius=0.25)
    rooms.track((7, *IN_DOOR))
    pose = rooms.find(where=True).waiting_pose
    at = pose.pose.se2
    assert pose.header.frame_id == "map" and at.x < DOOR - 0.8
    assert abs(math.atan2(2.0 - at.y, DOOR - at.x) - at.yaw) < 0.3


def test_marks_out_of_sight_do_not_close_the_path() -> None:
    """The door was seen closed from near, and the robot is far from it now."""
    rooms = closed_door()
    assert rooms.find().blocked
    far = Rooms(localized=False)
    poses = (("map", "odom", SE2(0.3, 0.3, 0.0)), ("odom", "base_link", IDENTITY))
    for parent, child, pose in poses:
        far.send("tf_static", TFMessage((TransformStamped.of(0, parent, child, pose),)))
    far.send_map()
    far.mark(*((DOOR, y) for y in np.arange(1.5, 2.55, 0.1)))
    distance = math.hypot(DOOR - 0.3, 1.7)
    assert distance > GLOBAL_COSTMAP.marking_range and not far.find().blocked


def test_a_new_map_and_new_zones_count_at_once() -> None:
    rooms = Rooms()
    rooms.send_map()
    rooms.mark(IN_DOOR, radius=0.25)
    rooms.track((7, *IN_DOOR))
    assert rooms.find(where=True).blocked
    corners = tuple(Point(x, y) for x, y in ((3.5, 0.0), (4.5, 0.0), (4.5, 4.0), (3.5, 4.0)))
    header = Header.of(0, "map")
    rooms.send("zones", MapZones(header, (MapZone("works", KEEP_OUT, corners),)))
    assert not rooms.find().blocked, "without the person no path leads there, either"
    rooms.send("zones", MapZones(header))
    assert rooms.find().blocked
    walled = two_rooms(door=1.0)
    walled.cells[:, 82:84] = 100
    rooms.send_map(walled)
    rooms.mark(IN_DOOR, radius=0.25)
    assert not rooms.find(where=True).blocked


def test_what_occupies_the_goal_is_found_beside_a_free_path() -> None:
    rooms = Rooms()
    rooms.send_map()
    assert not rooms.find().goal_occupied
    rooms.mark((THERE.x + 0.1, THERE.y), radius=0.08)
    found = rooms.find()
    assert found.goal_occupied and not found.blocked
    assert found.sensor == "lidar" and found.marked_at.ns == 4_000_000_000
    assert math.dist((found.point.x, found.point.y), (THERE.x + 0.1, THERE.y)) < 0.12


def test_a_goal_in_unknown_space_is_not_occupied() -> None:
    rooms = Rooms()
    row, column = rooms.grid.cell(THERE.x, THERE.y)
    rooms.grid.cells[row - 8 : row + 8, column - 8 : column + 8] = -1
    rooms.send_map()
    assert not rooms.find().goal_occupied

"""The costmap of the whole map: where each sensor marks in it, what clears it, and the layers that it has."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.costmap.layers import InflationLayer, StaticLayer
from chefbot.costmap.params import GLOBAL_COSTMAP, CostmapParams
from chefbot.costmap.sources import CAMERA, CONTACT, DROP_OFFS, LASER, RANGER
from chefbot.errors import ChefbotError
from chefbot.maths.costs import LETHAL
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point, PointStamped, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.global_costmap import GlobalCostmapNode
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.robot.load import load_robot
from chefbot.runtime.node import every

MAP_T_ODOM = SE2(5.0, 3.0, math.pi / 2)


class GlobalParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that a node with the costmap of the map must have."""

    costmap: CostmapParams = GLOBAL_COSTMAP


class Costs(GlobalCostmapNode):
    """A node with the costmap alone."""

    params: GlobalParams

    @every(hz=20)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Hall(NodeRunner):
    """The node on a map of 10 m by 10 m; the robot is at the origin of odom, its sensors in base_link."""

    def __init__(self, *, with_map: bool = True, localized: bool = True) -> None:
        super().__init__({"costs": f"{__name__}:Costs"}, {})
        self.node: Any = self.system.nodes["costs"]
        if with_map:
            self.send(
                "map", OccupancyGrid.of(Header.of(0, "map"), Grid(np.zeros((200, 200), np.int8), 0.05, 0, 0))
            )
        self.place("odom", "base_link", IDENTITY, "tf_static")
        if localized:
            self.place("map", "odom", MAP_T_ODOM)

    def place(self, parent: str, child: str, pose: SE2, topic: str = "tf") -> None:
        self.send(topic, TFMessage((TransformStamped.of(self.loop.now_ns, parent, child, pose),)))

    def send(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "test", from_device=True)
        self.run(0.05)

    def header(self) -> Header:
        return Header.of(self.loop.now_ns, "base_link")

    def scan(self, metres: float = 1.02) -> None:
        ranges = np.array([metres], np.float32)
        self.send("scan", LaserScan(self.header(), 0.0, 0.0, 0.01, 0.0, 0.1, 0.1, 8.0, ranges))

    def marked(self, source: str) -> list[tuple[float, float]]:
        """Return the middles of the marks of a source, in odom."""
        costs = self.node._costs
        if not costs.has_source(source):
            return []
        cells = np.argwhere(costs.source_cells(source) == LETHAL)
        places = MAP_T_ODOM.inverse().apply((cells[:, ::-1] + 0.5) * 0.05)
        return [(x, y) for x, y in places.tolist()]


def test_sensors_mark_where_localization_has_them() -> None:
    hall = Hall()
    hall.scan()
    ((x, y),) = hall.marked(LASER)
    assert (x, y) == pytest.approx((1.02, 0.0), abs=0.03)
    assert hall.node._costs.marked_by(5.0 - y, 3.0 + x).time == pytest.approx(0.15, abs=0.06)


@pytest.mark.parametrize("hall", [{"localized": False}, {"with_map": False}], ids=["lost", "no map"])
def test_nothing_is_marked_without_a_map_or_a_pose(hall: dict[str, bool]) -> None:
    one = Hall(**hall)
    one.scan()
    assert one.marked(LASER) == [] and not one.node._costs.sources


def answer_to(hall: Hall, x: float, y: float, frame: str = "map") -> Any:
    """The cell that is published for a point, None for none."""
    answers: list[Any] = []
    hall.loop.add_observer(lambda one: answers.append(one.message) if one.topic == "costmap_cell" else None)
    hall.send("clicked_point", PointStamped(Header.of(hall.loop.now_ns, frame), Point(x, y, 0.0)))
    return answers[0] if answers else None


def test_a_clicked_cell_is_published_with_its_marks() -> None:
    hall = Hall()
    hall.scan()
    cell = answer_to(hall, 1.02, 0.0, "odom")
    assert (cell.point.x, cell.point.y) == pytest.approx((5.0, 4.02), abs=0.05)
    assert cell.inside and cell.cost == LETHAL and cell.resolution == pytest.approx(0.05)
    (mark,) = cell.marks
    assert mark.source == "lidar" and 0 < mark.marked_at.ns <= hall.loop.now_ns
    beside = answer_to(hall, 5.0, 4.2)
    assert beside.inside and 0 < beside.cost < LETHAL and beside.marks == ()
    outside = answer_to(hall, 50.0, 4.2)
    assert not outside.inside and outside.marks == () and outside.point.x == 50.0


def test_a_clicked_cell_needs_a_map_and_a_frame() -> None:
    assert answer_to(Hall(with_map=False), 1.0, 1.0) is None
    assert answer_to(Hall(), 1.0, 1.0, "nowhere") is None


def test_camera_ranger_and_contacts_have_their_layers() -> None:
    hall = Hall()
    names = ("ranges", "clear_from", "clear_to", "bottom", "top")
    values = (0.8, 0.3, 0.7, 0.02, 0.1)
    arrays = {name: np.array([value], np.float32) for name, value in zip(names, values, strict=True)}
    hall.send(
        "obstacles",
        ObstacleScan(hall.header(), angle_min=0.0, angle_increment=0.01, range_max=4.0, **arrays),
    )
    assert hall.marked(CAMERA) == [pytest.approx((0.8, 0.0), abs=0.04)]
    hall.send("contact", PoseStamped(hall.header()))
    touched = hall.marked(CONTACT)
    assert touched and all(math.hypot(*at) < ROBOT.circumscribed_radius + 0.1 for at in touched)
    for _ in range(10):
        hall.send("ultrasonic", Range(hall.header(), 0, 0.5, 0.02, 4.0, 0.6))
    echoes = hall.marked(RANGER)
    assert echoes and all(abs(math.hypot(*at) - 0.6) < 0.15 for at in echoes)


def test_a_measurement_waits_for_its_odometry() -> None:
    hall = Hall()
    hall.place("odom", "camera", SE2(0.0, 1.0, 0.0))  # moves
    contact = PoseStamped(Header.of(hall.loop.now_ns + 10_000_000, "camera"))
    hall.send("contact", contact)
    assert hall.marked(CONTACT) == []
    hall.place("odom", "camera", SE2(0.0, 1.0, 0.0))
    assert all(y > 0.7 for _, y in hall.marked(CONTACT)) and hall.marked(CONTACT)


def mark(hall: Hall, source: str, x: float, y: float) -> None:
    costs, (mx, my) = hall.node._costs, MAP_T_ODOM.apply(np.array([[x, y]]))[0]
    costs.source_cells(source)[math.floor(my / 0.05), math.floor(mx / 0.05)] = LETHAL


def test_clearing_near_the_robot_keeps_what_others_do_not_see() -> None:
    hall = Hall()
    sources = (LASER, CAMERA, DROP_OFFS, CONTACT, RANGER)
    for source in sources:
        mark(hall, source, 0.5, 0.0)
        mark(hall, source, 3.0, 0.0)
    hall.send("clear_costmaps", Float64(1.0))
    assert [len(hall.marked(source)) for source in sources] == [1, 1, 2, 2, 2]
    assert all(x > 2.9 for source in (LASER, CAMERA) for x, _ in hall.marked(source))


def test_a_lost_robot_clears_everything() -> None:
    hall = Hall(localized=False)
    for source in (LASER, CONTACT):
        mark(hall, source, 3.0, 0.0)
    hall.send("clear_costmaps", Float64(1.0))
    assert not hall.node._costs.sources


@pytest.mark.parametrize(("jump", "kept"), [(SE2(0.05, 0.0, 0.0), True), (SE2(2.0, 0.0, 0.0), False)])
def test_marks_from_before_a_jump_of_the_pose_go(jump: SE2, kept: bool) -> None:
    hall = Hall()
    for _ in range(3):
        hall.scan()
    mark(hall, CAMERA, 3.0, 0.0)
    hall.place("map", "odom", MAP_T_ODOM @ jump)
    hall.scan(2.0)
    assert bool(hall.marked(CAMERA)) == kept and hall.marked(LASER)


def test_a_contact_outlives_the_correction_of_slipped_wheels() -> None:
    hall = Hall()
    hall.scan()
    hall.send("contact", PoseStamped(Header.of(hall.loop.now_ns, "base_link")))
    touched = hall.marked(CONTACT)
    for correction in (0.3, 0.6):
        hall.place("map", "odom", MAP_T_ODOM @ SE2(correction, 0.0, 0.0))
        hall.scan(2.0)
    assert len(hall.marked(CONTACT)) == len(touched) > 0


@pytest.mark.parametrize("corrected", [False, True])
def test_a_contact_has_the_pose_from_before_the_slip(corrected: bool) -> None:
    """Localization corrects the slip later, or has begun to: the pose on the map at that time is right."""
    hall = Hall()
    hall.place("odom", "body", IDENTITY)
    contact = PoseStamped(Header.of(hall.loop.now_ns, "body"))
    hall.place("odom", "body", IDENTITY)
    hall.place("map", "odom", MAP_T_ODOM)
    hall.place("odom", "body", SE2(0.4, 0.0, 0.0))
    if corrected:
        hall.place("map", "odom", MAP_T_ODOM @ SE2(-0.4, 0.0, 0.0))
    hall.send("contact", contact)
    touched = hall.marked(CONTACT)
    assert touched and all(math.hypot(*at) < ROBOT.circumscribed_radius + 0.1 for at in touched)


def test_the_costmap_is_shown_each_second_once_there_is_a_map() -> None:
    hall = Hall(with_map=False)
    hall.run(3.0)
    assert hall.messages("global_costmap/costmap") == []
    hall = Hall()
    mark(hall, LASER, 1.0, 0.0)
    hall.run(3.0)
    shown = hall.messages("global_costmap/costmap")
    assert len(shown) == 3 and shown[-1].header.frame_id == "map"
    assert (shown[-1].data == 100).sum() == 1


def test_zones_are_obeyed_and_withdrawn() -> None:
    hall = Hall()
    corners = tuple(Point(x, y) for x, y in ((2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (2.0, 3.0)))
    header = Header.of(0, "map")
    hall.send("zones", MapZones(header, (MapZone("stairs", KEEP_OUT, corners),)))
    assert hall.node._costs.update().at(2.5, 2.5) == LETHAL
    hall.send("zones", MapZones(header))
    assert hall.node._costs.update().at(2.5, 2.5) == 0


def test_parameters_apply_and_marks_stay() -> None:
    hall = Hall()
    hall.scan()
    before = (hall.node._costs.update().cells > 0).sum()
    wider = msgspec.structs.replace(GLOBAL_COSTMAP, inflation_radius=1.5, cost_scaling_factor=1.0)
    hall.node.reconfigure(GlobalParams(costmap=wider))
    assert hall.marked(LASER) and (hall.node._costs.update().cells > 0).sum() > 2 * before
    assert all(name.removeprefix("costmap.") in CostmapParams.__struct_fields__ for name in Costs.live_params)


# ---- the layers that the parameters name


@pytest.mark.parametrize(
    ("robot", "rolling", "avoids"),
    [("chefbot", False, True), ("chefbot", True, False), ("chefbot_lidar", False, False)],
)
def test_a_robot_that_sees_only_ahead_avoids_unknown_space(robot: str, rolling: bool, avoids: bool) -> None:
    costs = make_costmap(CostmapParams(), load_robot(robot), rolling=rolling)
    assert (costs.avoid_unknown, costs.rolling) == (avoids, rolling)
    assert len(costs.layers) == len(CostmapParams().layers)


def test_the_layers_are_those_of_the_parameters_in_their_order() -> None:
    names = ("chefbot.costmap.layers:InflationLayer", "chefbot.costmap.layers:StaticLayer")
    costs = make_costmap(CostmapParams(layers=names), ROBOT, rolling=False)
    assert [type(layer) for layer in costs.layers] == [InflationLayer, StaticLayer]


@pytest.mark.parametrize("name", ["nothing", "chefbot.costmap.layers:Nothing", "chefbot.nowhere:Layer"])
def test_a_layer_that_does_not_exist_is_reported_in_one_sentence(name: str) -> None:
    with pytest.raises(ChefbotError, match=name.replace(":", ".")):
        make_costmap(CostmapParams(layers=(name,)), ROBOT, rolling=False)

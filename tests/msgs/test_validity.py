"""What is refused at the border, with which sentence; and that plausible messages of real drivers pass."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, MapZone, MapZones
from chefbot.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Twist,
    covariance_36,
)
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import NavigateToPose_Goal
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid, Odometry, Path
from chefbot.msgs.people_msgs import People, Person
from chefbot.msgs.sensor_msgs import BatteryState, Image, Imu, JointState, LaserScan, Range
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import MAX_FUTURE_NS, check, check_stamp

SECOND = 1_000_000_000


def scan(**changes: Any) -> LaserScan:
    n, step = 360, 2.0 * math.pi / 360
    whole = LaserScan(Header(), 0.0, step * (n - 1), step, 0.0, 0.1, 0.1, 12.0, np.ones(n, np.float32))
    return replace(whole, **changes)


def obstacles(**changes: Any) -> ObstacleScan:
    ones = np.ones(9, np.float32)
    return replace(ObstacleScan(Header(), -0.5, 0.1, 4.0, ones, ones, ones), **changes)


def grid(
    width: int = 10, height: int = 10, n: int = 100, resolution: float = 0.05, value: int = 0
) -> Message:
    info = MapMetaData(Time(), resolution, width, height, Pose())
    return OccupancyGrid(Header(), info, np.full(n, value, np.int8))


def click(covariance: NDArray[np.float64]) -> Message:
    return PoseWithCovarianceStamped(Header(), PoseWithCovariance(Pose(), covariance))


def image(**changes: Any) -> Image:
    return replace(Image(Header(), 2, 3, "32FC1", 0, 12, np.zeros(24, np.uint8)), **changes)


def path(*places: tuple[float, float]) -> Message:
    return Path(Header(), tuple(PoseStamped(Header(), Pose(Point(x, y))) for x, y in places))


def zones(kind: str, count: int, corners: int = 3) -> Message:
    return MapZones(Header(), tuple(MapZone(str(i), kind, (Point(),) * corners) for i in range(count)))


def person(**changes: Any) -> Message:
    return People(Header(), (replace(Person("anna", reliability=1.0), **changes),))


FULL_SCAN, LINE = np.ones(360, np.float32), np.eye(6)
WITH_UNKNOWN = np.array([np.nan, np.inf, -np.inf, 0.0, -1.0] * 72, np.float32)
CORRELATED = np.eye(6).reshape(-1) * 0.1
CORRELATED[[1, 6]] = 0.2
TRANSFORM = TransformStamped.of(0, "odom", "base", SE2(0.0, 0.0, 0.0))
NOT_MEASURED = np.array([-1.0, *[0.0] * 8])

REFUSED: list[tuple[Message, str]] = [
    (click(covariance_36(np.diag([-0.1, 0.1, 0.1]))), "pose.covariance holds the variance -0.1"),
    (click(CORRELATED), "pose.covariance holds a covariance that is larger"),
    (click(np.full(36, np.nan)), "pose.covariance holds a number that is not finite"),
    (grid(n=99), "data has 99 cells, but the map has 10 x 10"),
    (grid(0, 0, 0), "info: a map of 0 x 0"),
    (grid(resolution=0.0), "info.resolution is 0"),
    (grid(resolution=3e38), "info.resolution is 3e\\+38"),
    (grid(resolution=99.0), "info: the map covers"),
    (grid(value=101), "data holds cells that are neither"),
    (grid(10_000, 10_000, 0, 0.001), "info: 10000 x 10000 cells of 0.001 m take too long"),
    (scan(angle_increment=3e38), "ranges span more than a turn|no measure"),
    (scan(angle_increment=0.0), "angle_increment is 0"),
    (scan(angle_max=1.0), "ranges has 360 elements, its angles say"),
    (scan(ranges=FULL_SCAN[:100]), "ranges has 100 elements"),
    (scan(range_min=13.0), "range_min is 13, above range_max"),
    (scan(range_max=math.inf), "range_max is inf"),
    (obstacles(clear_to=np.ones(8, np.float32)), "clear_to has 8 elements, ranges has 9"),
    (obstacles(top=np.ones(8, np.float32)), "top has 8 elements, ranges has 9"),
    (obstacles(angle_increment=2.0), "span more than a turn"),
    (image(height=3), "data has 24 bytes, 3 rows of 12 have 36"),
    (image(step=4, height=6), "step is 4, 3 pixels of 32FC1 need 12"),
    (PoseStamped(Header(), Pose(Point(1e7))), "pose.position.x is 1e\\+07"),
    (
        PoseStamped(Header(), Pose(Point(), Quaternion(0, 0, 0, 0))),
        "pose.orientation.norm is 0",
    ),
    (PoseStamped(Header(), Pose(Point(), Quaternion(0, 0, 1e200, 0))), "no rotation|no measure"),
    (NavigateToPose_Goal(PoseStamped(Header(), Pose(Point(math.nan)))), "pose.pose.position.x is nan"),
    (Odometry(pose=PoseWithCovariance(Pose(Point(math.nan)))), "pose.pose.position.x is nan"),
    (
        TFMessage((replace(TRANSFORM, child_frame_id="odom"),)),
        "child_frame_id are 'odom' and 'odom', not two",
    ),
    (TFMessage((replace(TRANSFORM, child_frame_id=""),)), "not two frames"),
    (Imu(angular_velocity_covariance=np.full(9, -2.0)), "angular_velocity_covariance holds the variance -2"),
    (WheelTicks(Header(), 2**62, 0), "left is 4.61169e\\+18"),
    (Twist.of(1e300, 0.0), "linear.x is 1e\\+300"),
    (Float64(1e308), "data is 1e\\+308"),
    (PoseStamped(Header(Time(0, 2_000_000_000))), "header.stamp.nanosec is 2e\\+09"),
    (PoseStamped(Header(Time(-1, 0))), "header.stamp.sec is -1"),
    (path((0.0, 0.0), (9e5, 0.0)), "poses lead over 900000 m"),
    (JointState(Header(), ("a", "b"), np.zeros(3)), "position has 3 elements, name has 2"),
    (Range(Header(), 0, 0.5, 4.0, 0.02, 1.0), "min_range is 4, above max_range"),
    (zones(KEEP_OUT, 1, corners=2), "zones.corners has 2 elements, at least 3 are needed"),
    (zones(ONE_WAY, 256), "zones holds 256 one-way lanes, at most 255 can be used"),
    (person(reliability=1.01), "people.reliability is 1.01, it must lie between 0 and 1"),
    (person(tagnames=("age",)), "people.tags has 0 elements, tagnames has 1"),
    (People(people=(Person(),) * 1001), "people has 1001 elements, at most 1000 can be used"),
]
ACCEPTED: list[Message] = [
    scan(),
    scan(ranges=WITH_UNKNOWN),
    scan(angle_max=2.0 * math.pi),  # one beam off, as drivers of turning lidars are
    scan(ranges=np.empty(0, np.float32)),
    scan(angle_min=math.pi, angle_increment=-2.0 * math.pi / 360, angle_max=-math.pi),
    obstacles(clear_from=np.full(9, np.inf, np.float32)),
    grid(),
    grid(value=-1),
    image(),
    image(encoding="bayer_rggb8", step=3, height=8),
    click(np.zeros(36)),
    click(covariance_36(np.diag([0.25, 0.25, 0.07]))),
    Odometry(pose=PoseWithCovariance(Pose(), np.diag([0.1, 0.1, 1e6, 1e6, 1e6, 0.2]).reshape(-1))),
    Imu(orientation=Quaternion(0, 0, 0, 0), orientation_covariance=NOT_MEASURED),
    Imu(angular_velocity_covariance=NOT_MEASURED),
    BatteryState(),
    Range(Header(), 0, 0.5, 0.02, 4.0, math.inf),
    TFMessage((TRANSFORM,)),
    path(),
    path((0.0, 0.0), (100.0, 0.0)),
    zones(ONE_WAY, 255),
    zones(KEEP_OUT, 256),
    person(tagnames=("age", "role"), tags=("7", "guest")),
]


@pytest.mark.parametrize(("message", "pattern"), REFUSED, ids=lambda one: one if isinstance(one, str) else "")
def test_invalid_messages_are_refused_by_field_name(message: Message, pattern: str) -> None:
    with pytest.raises(InvalidMessageError, match=pattern):
        check(message)


@pytest.mark.parametrize("message", ACCEPTED, ids=lambda one: type(one).__name__)
def test_messages_of_common_drivers_are_accepted(message: Message) -> None:
    check(type(message).from_cdr(message.to_cdr()))


@pytest.mark.parametrize("ahead_ns", [MAX_FUTURE_NS, MAX_FUTURE_NS + 1, 3600 * SECOND])
def test_measurements_from_the_future_are_refused(ahead_ns: int) -> None:
    now_ns = 1_000 * SECOND
    stamp = Header.of(now_ns + ahead_ns, "odom")
    for message in (scan(header=stamp), TFMessage((replace(TRANSFORM, header=stamp),))):
        if ahead_ns <= MAX_FUTURE_NS:
            check_stamp(message, now_ns)
        else:
            with pytest.raises(InvalidMessageError, match="ahead of the robot's clock"):
                check_stamp(message, now_ns)
    check_stamp(PoseStamped(stamp), now_ns)
    check_stamp(scan(header=Header.of(0, "laser")), now_ns)

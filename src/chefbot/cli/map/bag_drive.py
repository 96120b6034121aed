"""The scans of a drive in a bag, each with the odometry's pose at its time."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.cli.map.laser_mount import LaserMount, laser_mount, turned_upright
from chefbot.config import ConfigError
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.plural import number_of
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.reader import BagMessage, BagTopic, read_bag
from chefbot.ros2.bag.rosbags_reader import RosbagsBag, needs_rosbags
from chefbot.scan.deskewing import deskewed, knot_times
from chefbot.slam.carmen import parse, without_cut_line
from chefbot.slam.offline import laser_scans
from chefbot.slam.recorded_scan import NO_RETURN, RecordedScan
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.carmen_log import read_text

SCAN, ODOMETRY, TF = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"
ODOM, MAP = "odom", "map"
"""Frames of odometry and of the map (REP-105)."""
MAX_GAP_NS = 500_000_000
"""Time from a scan to the nearest odometry up to which it is used, ns."""
MAX_BACK_NS = 1_000_000_000
"""Time by which messages may be out of order, ns; more is a clock that was set back."""
MAX_OFFSET = 10.0
"""Limit of the coordinates of a laser on a robot, m."""
M = TypeVar("M", bound=Message)


class AnyBag(Protocol):
    """A bag of any format."""

    @property
    def topics(self) -> Sequence[BagTopic]:
        """Topics of the bag, each with its type and number of messages."""

    def messages(self, topics: set[str]) -> Iterator[BagMessage]:
        """Iterate over the messages of topics in the order of their times."""


class BagDrive(NamedTuple):
    """The scans of a bag in the order of their times, and what is to be known about them, as sentences."""

    scans: list[RecordedScan]
    notes: list[str]


class BagChoice(NamedTuple):
    """What of a bag is used: topics, empty for the only one; and the pose of the laser, where the bag has none."""

    scan_topic: str = ""
    odometry_topic: str = ""
    laser: SE2 | None = None

    @staticmethod
    def of(scan_topic: str, odometry_topic: str, laser: tuple[float, float, float] | None) -> BagChoice:
        """Return the choice by the options of a command. Raises UserError for a pose that no laser has."""
        if laser is not None and not all(abs(value) < MAX_OFFSET for value in laser):
            raise UserError(f"--laser {laser} is not a place on a robot; give x and y in m, and yaw in rad")
        return BagChoice(scan_topic, odometry_topic, None if laser is None else SE2(*laser))


ONLY_TOPICS = BagChoice()
"""For bags with one topic of each type, or with the usual names."""


def is_bag(path: Path) -> bool:
    """Return whether a path is that of a bag."""
    return os.path.isdir(path) or path.suffix in (".mcap", ".bag", ".db3")  # noqa: PTH112 - any length of name


class OdometryTrack:
    """The poses of the base by odometry at the times (n,), ns, of its messages; in between they are interpolated."""

    def __init__(self, times: Sequence[int], poses: Sequence[SE2]) -> None:
        self._times, first = np.unique(np.array(times, np.int64), return_index=True)
        x, y, yaw = np.array(poses, np.float64)[first].T
        self._x, self._y, self._yaw = x, y, np.unwrap(yaw)

    def covers(self, time_ns: int) -> bool:
        """Return whether there is odometry shortly before or after a time."""
        after = int(np.searchsorted(self._times, time_ns))
        return bool(np.abs(self._times[max(after - 1, 0) : after + 1] - time_ns).min() <= MAX_GAP_NS)

    def at(self, time_ns: int) -> SE2:
        """Return the pose at a time."""
        x, y, yaw = (float(np.interp(time_ns, self._times, v)) for v in (self._x, self._y, self._yaw))
        return SE2(x, y, math.remainder(yaw, math.tau))


@contextmanager
def naming_log(path: Path) -> Iterator[None]:
    """Turn an error of a log's content into a UserError that names the file; others name theirs already."""
    try:
        yield
    except (StorageError, UserError, BagError, ConfigError):
        raise
    except ChefbotError as error:
        raise UserError(f"log {path}: {error}") from None


def read_log(path: Path, choice: BagChoice) -> BagDrive:
    """Read the scans of a bag or a CARMEN log. Raises UserError, CarmenLogError or BagError if it has none."""
    if is_bag(path):
        return read_drive(path, choice)
    text, cut_file = read_text(path)
    text, cut_line = without_cut_line(text)
    return BagDrive(laser_scans(parse(text)), [note for note in (cut_file, cut_line) if note])


def read_drive(path: Path, choice: BagChoice) -> BagDrive:
    """Read the scans of a bag. Raises BagError or UserError if it has no scans, odometry or pose of the laser."""
    if needs_rosbags(path):
        return _DriveReader(path, RosbagsBag(path)).drive(choice)
    bag = read_bag(path)
    drive = _DriveReader(path, bag).drive(choice)
    return drive._replace(notes=[*(f"{sentence}." for sentence in bag.truncated), *drive.notes])


class _DriveReader:
    """Reads the drive of one bag; `notes` collects what was left out."""

    def __init__(self, path: Path, bag: AnyBag) -> None:
        self._path, self._bag, self._notes = path, bag, list[str]()

    def drive(self, choice: BagChoice) -> BagDrive:
        """Return the scans with the odometry's poses."""
        topic = self._chosen(SCAN, choice.scan_topic, "scan", "--scan-topic")
        scans = self._scans(topic) if topic is not None else []
        if not scans:
            raise UserError(f"bag {self._path} has no laser scans (sensor_msgs/LaserScan)")
        track, base = self._odometry(choice.odometry_topic)
        mount = self._mount(base, scans[0].header.frame_id, choice.laser)
        used = [scan for scan in scans if track.covers(scan.header.stamp.ns)]
        if not used:
            raise UserError(f"bag {self._path}: no scan was measured while there was odometry")
        if len(used) < len(scans):
            self._notes.append(
                f"{len(scans) - len(used)} of {len(scans)} scans without odometry are left out."
            )
        return BagDrive([_recorded(scan, track, mount) for scan in used], self._notes)

    def _scans(self, topic: str) -> list[LaserScan]:
        """Return the usable scans in the order of their times. Raises UserError where no map can come from them."""
        scans = list(self._decoded(LaserScan, topic))
        self._check_times([scan.header.stamp.ns for scan in scans], topic)
        for number, scan in enumerate(scans, 1):
            if reason := angle_fault(scan):
                raise UserError(f"bag {self._path}: scan {number} on {topic}: {reason}")
        usable = [scan for scan in scans if len(scan.ranges) > 1]
        if len(usable) < len(scans):
            self._notes.append(
                f"{len(scans) - len(usable)} of {len(scans)} scans without beams are left out."
            )
        if usable and not any(_is_measured(scan).any() for scan in usable):
            raise UserError(f"bag {self._path}: no scan on {topic} has a range within its limits")
        return sorted(usable, key=lambda scan: scan.header.stamp.ns)

    def _check_times(self, times: Sequence[int], topic: str) -> None:
        """Raise UserError if the clock was set back: what is measured twice at one time cannot be put in order."""
        steps = np.diff(np.array(times, np.int64))
        if len(steps) and steps.min() < -MAX_BACK_NS:
            number = int(steps.argmin()) + 2
            raise UserError(
                f"bag {self._path}: at message {number} on {topic} the time goes back by {-steps.min() / 1e9:.1f} s;"
                " use the part before or after it"
            )

    def _chosen(self, kind: str, given: str, usual: str, option: str) -> str | None:
        """Return a topic of a type: the given one, that with the usual name, or the only one; None without any."""
        names = sorted(
            {topic.name for topic in self._bag.topics if topic.kind.name == kind and topic.messages}
        )
        for name in names:
            if name.strip("/") == (given or usual).strip("/"):
                return name
        if given or len(names) > 1:
            reason = f"no {given}" if given else "more than one topic"
            known = ", ".join(names) or "none"
            raise UserError(f"bag {self._path} has {reason} of {kind}: choose {option} of {known}")
        return names[0] if names else None

    def _decoded(self, kind: type[M], topic: str) -> Iterator[M]:
        """Yield the messages of a topic; those that are not valid are counted."""
        invalid, reason = 0, ""
        for message in self._bag.messages({topic}):
            try:
                yield kind.from_cdr(message.data)
            except (CdrError, InvalidMessageError) as error:
                invalid, reason = invalid + 1, str(error)
        if invalid:
            self._notes.append(f"{number_of(invalid, 'message')} on {topic} left out, the last as {reason}.")

    def _odometry(self, given: str) -> tuple[OdometryTrack, str]:
        """Return the odometry and the frame that it moves: of its topic, else of the transforms from `odom`."""
        topic = self._chosen(ODOMETRY, given, ODOM, "--odometry-topic")
        if topic is not None:
            messages = list(self._decoded(Odometry, topic))
            samples = [(one.header.stamp.ns, one.pose.pose.se2) for one in messages]
            base = messages[0].child_frame_id if messages else ""
            return self._track(samples, topic), base or "base_link"
        moving = [one for one in self._transforms("tf") if one.header.frame_id.strip("/") == ODOM]
        if not moving:
            raise UserError(
                f"bag {self._path} has neither odometry (nav_msgs/Odometry) nor transforms from odom"
            )
        child = moving[0].child_frame_id
        own = [one for one in moving if one.child_frame_id == child]
        return self._track([(one.header.stamp.ns, one.transform.se2) for one in own], "/tf"), child

    def _track(self, samples: Sequence[tuple[int, SE2]], topic: str) -> OdometryTrack:
        """Return the odometry by its finite samples. Raises UserError if there are none, or the time goes back."""
        self._check_times([time_ns for time_ns, _ in samples], topic)
        finite = [(time_ns, pose) for time_ns, pose in samples if np.isfinite(pose).all()]
        if not finite:
            raise UserError(f"bag {self._path}: no pose on {topic} is valid and finite")
        if len(finite) < len(samples):
            self._notes.append(f"{len(samples) - len(finite)} poses on {topic} are not finite, left out.")
        return OdometryTrack([time_ns for time_ns, _ in finite], [pose for _, pose in finite])

    def _transforms(self, name: str) -> Iterator[TransformStamped]:
        for topic in self._bag.topics:
            if topic.kind.name == TF and topic.name.strip("/") == name:
                for message in self._decoded(TFMessage, topic.name):
                    yield from message.transforms

    def _mount(self, base: str, laser: str, given: SE2 | None) -> LaserMount:
        """Return the pose of the laser on the base: the given one, or that of the bag's transforms."""
        if given is not None:
            return LaserMount(given)
        fixed = list(self._transforms("tf_static"))
        found = laser_mount(fixed, base, laser)
        if found is None:  # a publisher of the robot's state may send fixed joints on tf, too
            moving = [
                one for one in self._transforms("tf") if one.header.frame_id.strip("/") not in (ODOM, MAP)
            ]
            found = laser_mount([*moving, *fixed], base, laser)
        if found is None:
            raise UserError(
                f"bag {self._path} has no transform from {base} to {laser}: give the laser's pose by --laser X Y YAW"
            )
        return found


def angle_fault(scan: LaserScan) -> str:
    """Return why the angles of a scan are not those of a laser; empty if they are."""
    first, step = float(scan.angle_min), float(scan.angle_increment)
    span = abs(step) * max(len(scan.ranges) - 1, 0)
    if not (math.isfinite(first) and math.isfinite(step) and step):
        return f"angle_min is {first:g} and angle_increment {step:g}, which no laser has"
    if span > math.tau + abs(step):
        return f"{len(scan.ranges)} beams with an angle_increment of {step:g} are more than a turn"
    return ""


def _is_measured(scan: LaserScan) -> NDArray[np.bool_]:
    return np.isfinite(scan.ranges) & (scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max)


def _recorded(scan: LaserScan, track: OdometryTrack, mount: LaserMount) -> RecordedScan:
    """Return a scan without skew, as if it had been measured at the time of its first beam."""
    if mount.upside_down:
        scan = turned_upright(scan)
    scan = deskewed(scan, [track.at(time_ns) @ mount.pose for time_ns in knot_times(scan)])
    ranges, odom = scan.ranges.astype(np.float32), track.at(scan.header.stamp.ns)
    invalid = np.isnan(ranges) | (ranges < scan.range_min)
    ranges = np.where(
        ranges > scan.range_max, np.float32(NO_RETURN), np.where(invalid, np.float32(0.0), ranges)
    )
    stamp = scan.header.stamp.ns / 1e9
    return RecordedScan(stamp, scan.angles.astype(np.float32), ranges, odom @ mount.pose, odom)

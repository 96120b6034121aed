"""What the layers of the web UI show: the payload of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.incidents.files import SavedIncident
from chefbot.maths.cell_grid import CellGrid
from chefbot.maths.se2 import SE2


class RobotView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Estimated pose of the robot in the map frame (m, rad) and its velocity (m/s, rad/s)."""

    x: float
    y: float
    yaw: float
    v: float = 0.0
    w: float = 0.0


class ViewCone(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a sensor sees seen from above: its pose in base_link (m, rad), field of view (rad) and range (m)."""

    x: float
    y: float
    yaw: float
    field_of_view: float
    range: float


class ShapeView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The robot seen from above in base_link, m: circumscribed radius, footprint, wheels and sensors."""

    radius: float
    corners: tuple[tuple[float, float], ...]
    """Corners of the footprint; empty for a disc of `radius`."""
    wheels: tuple[tuple[float, float, float, float], ...]
    """Centre (x, y), length and width of each wheel."""
    cones: tuple[ViewCone, ...]
    """Sensors that do not see all around."""


@dataclass(frozen=True, eq=False)
class PlacedGrid:
    """A grid in a frame of its own, whose pose in the map is `frame`."""

    grid: CellGrid
    frame: SE2


@dataclass(frozen=True, eq=False)
class ScanView:
    """A laser scan: ranges (n,) in metres at angles (n,) in radians, from the sensor's pose (x, y, yaw)."""

    pose: Sequence[float]
    angles: NDArray[Any]
    ranges: NDArray[Any]
    frame: str = ""
    """Frame of the sensor, which gives its height above the floor."""

    def points(self) -> NDArray[np.float64]:
        """Return the end points of the finite beams, (m, 2), in the frame of the pose."""
        x, y, yaw = self.pose
        ranges = np.asarray(self.ranges, np.float64)
        bearing = np.asarray(self.angles, np.float64) + yaw
        ends = np.column_stack([x + ranges * np.cos(bearing), y + ranges * np.sin(bearing)])
        return ends[np.isfinite(ranges)]


class FrameView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A frame in its parent: translation in metres, rotation as a quaternion (x, y, z, w), time stamp in seconds."""

    name: str
    parent: str
    at: tuple[float, float, float]
    turn: tuple[float, float, float, float]
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class DepthView:
    """A depth image (h, w) along the optical axis, in metres, NaN for none, or as unsigned integers in millimetres, 0
    for none; camera intrinsics in pixels; the optical frame."""

    depth: NDArray[Any]
    focal: float
    cx: float
    cy: float
    frame: str


class CandidatesView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Trajectories that the controller compared, each as x and y in turn (m, map frame), and how good each is: 0 for
    the best, 1 for the worst, None for one that is not admissible."""

    trajectories: tuple[tuple[float, ...], ...] = ()
    badness: tuple[float | None, ...] = ()


class CellView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A cell of the global costmap: its centre (m, map frame) and size (m), cost (0 to 255, None outside of it), and
    what marked it, with the age of each mark (s), None for what lasts."""

    x: float
    y: float
    size: float
    cost: int | None
    marks: tuple[tuple[str, float | None], ...] = ()


class LaunchView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Whether the launch that runs, which can be replaced by another one, makes a map, whether the map that it uses
    can be continued, because its drive is kept, why it runs, if another one was requested, and whether it is about to
    be replaced."""

    mapping: bool
    can_continue: bool = False
    notice: str = ""
    ends: bool = False


class SaveOutcome(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a request to save the map ended, in a sentence."""

    id: str
    sentence: str


class MappingView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Whether the robot explores, what the explorer does, what the mapper has last reported, how the last requests to
    save the map ended, the oldest first, and under which name a map was saved."""

    exploring: bool = False
    description: str = ""
    mapper: str = ""
    outcomes: tuple[SaveOutcome, ...] = ()
    saved: str = ""


class MapBundleView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The bundle of the map that is being made, in Base64, for the request with this id; empty if none is kept."""

    id: str
    bundle: str


class PersonView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A tracked person in the map frame: number, position (m), velocity (m/s), standard deviation of the position
    (m), and whether it was seen just now."""

    id: int
    x: float
    y: float
    vx: float
    vy: float
    deviation: float
    visible: bool


class ZoneView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A zone of the map: its title, its kind as in chefbot_msgs/MapZone, its corners (m) in the map frame, the
    direction of a one-way lane (rad) and the limit of a slow zone (m/s)."""

    title: str
    name: str
    kind: str
    corners: tuple[tuple[float, float], ...]
    direction: float
    speed: float


class DoorView(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A door of the simulated world; `open` is false only when it is fully closed."""

    name: str
    open: bool


def rounded(number: float | None, digits: int) -> float | None:
    """Return a number as it is displayed: changes that nobody sees are not sent."""
    return None if number is None else round(float(number), digits)


class StatusView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The robot's state as texts and numbers; None is unknown and shows as a dash."""

    phase: str = ""
    """Current activity, one sentence."""
    clock: float | None = None
    """Time since the start on the robot's clock, s."""
    real_time_factor: float | None = None
    battery: float | None = None
    """Battery charge, percent, 0..100."""
    volts: float | None = None
    pose_probability: float | None = None
    """Probability 0..1 that the pose on the map is right."""
    localization: str = ""
    """State of the localization and its cause, one sentence."""
    localization_error: float | None = None
    """Distance between estimate and ground truth, m; simulation only."""
    navigation: str = ""
    """State of the navigator, one or two words."""
    reason: str = ""
    """Why it stopped or slowed down the last time, one sentence."""
    stopped: bool = False
    """Whether the emergency stop is latched."""
    stop_pending: bool = False
    """Whether the emergency stop was pressed here and is not confirmed by the robot yet."""
    simulation: bool = False
    """Whether the web UI may offer boxes, doors and kidnapping."""
    warnings: tuple[str, ...] = ()
    """Diagnostics that are not OK, one sentence each."""
    failures: int = 0
    """Number of failed goals; `reason` is that of the last."""
    notice: str = ""
    """What the deliveries refused last, a sentence."""
    notices: int = 0
    """Number of such refusals."""
    doors: tuple[DoorView, ...] = ()
    """Doors that the simulation can move."""


class StopView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """State of the emergency stop in the drive base; sent before all other layers."""

    stopped: bool = False
    """Whether the emergency stop is latched."""
    requested: bool = False
    """Whether a press waits for confirmation by the drive base."""
    confirmed: tuple[str, ...] = ()
    """Ids of the newest presses that the drive base has confirmed."""
    pressed: str = ""
    """Time of the last press, nanoseconds, as text: JavaScript's numbers have too few digits."""


class WaitingOrderView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An order that waits for the current round; `id` is empty for one that cannot be changed."""

    id: str
    places: tuple[str, ...]


class DeliveryView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The delivery mission: tables still to serve, the current step as a sentence, and what a person has to
    confirm."""

    queue: tuple[str, ...] = ()
    order_id: str = ""
    step: str = ""
    guest_step: str = ""
    """The current step for a guest, who confirms nothing."""
    state: str = ""
    """State of the mission as in chefbot_msgs/DeliveryStatus."""
    place: str = ""
    """Place where the robot is or to which it drives."""
    waits_for: str = ""
    """What a person has to confirm: loaded, taken, choice, or nothing."""
    choices: tuple[str, ...] = ()
    """Possible choices now, of go_on, kitchen and end."""
    round_active: bool = False
    """Whether a round is active; a goal elsewhere must then contain `when`."""
    loaded: bool = False
    """Whether the food is on the tray."""
    errands: tuple[str, ...] = ()
    """Names of additional goals."""
    delivered: tuple[str, ...] = ()
    """Tables of this order that were served."""
    missed: tuple[str, ...] = ()
    """Why tables of this order were not served, a sentence each."""
    unserved: tuple[str, ...] = ()
    failed: bool = False
    """Whether the robot, and not a person, is why the last round did not serve all its tables."""
    """Tables of the last order that were not served and are not ordered again."""
    orders: tuple[WaitingOrderView, ...] = ()
    """Waiting orders, in the order in which they begin."""


class RoundStopView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stop that is left of a round: distance to it (m), time until the arrival (s), charge then (percent).

    reachable: whether the map shows a path to it.
    """

    place: str
    distance: float
    time: float
    battery: float | None
    reachable: bool = True


class CauseView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Why the robot slowed down, stopped, took a detour or failed; see chefbot_msgs/Cause."""

    id: int
    time: float
    """When it began on the robot's clock, s."""
    ended: float | None
    """When it ended, s; None while it holds."""
    effect: str
    """Slower, Stopped, Detour or Failed."""
    sentence: str
    chain: tuple[str, ...] = ()
    x: float | None = None
    y: float | None = None
    """Where the obstacle is on the map, m; None if there is none or it is not known."""
    number: int = 0
    """Its number in the history of the robot, 0 if it is not recorded."""
    pictures: tuple[str, ...] = ()
    """Pictures at `causes/NUMBER/PICTURE`: map, camera."""
    began: str = ""
    """When it began, UTC in ISO 8601, in an earlier run; then `time` is 0, and `ended` how long it lasted."""


class IncidentsView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The newest incidents, and how the last request to save one ended; `requests` counts those that have ended.

    recording_since: when the recording began that is under way, s on the robot's clock; None if there is none.
    recorded_by: who began it.
    """

    saved: tuple[SavedIncident, ...] = ()
    outcome: str = ""
    requests: int = 0
    recording_since: float | None = None
    recorded_by: str = ""


class PlaybackView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Position in a recording that is played, and its length, s; `rate` 0 is a pause."""

    time: float
    length: float
    rate: float
    title: str


class ProgressView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Progress of a long job such as 'compiling kernels': `done` of `total`."""

    text: str
    done: int
    total: int

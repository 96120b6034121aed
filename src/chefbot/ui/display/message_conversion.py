"""Messages as plain arrays for the web UI, and its clicks as messages."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.causes.statuses import NO_FAILURE
from chefbot.maths.cell_grid import CellGrid
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.diagnostic_msgs import OK, DiagnosticArray
from chefbot.msgs.geometry_msgs import (
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    covariance_36,
)
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.sensor_msgs import JointState
from chefbot.ui.display.views import DoorView, PersonView, ZoneView

DIAGNOSTICS_AGE_NS = 5_000_000_000
"""Time after which a diagnostic that was not repeated is no longer displayed, ns."""
CLICK_STD_XY, CLICK_STD_YAW = 0.5, 0.35
"""Standard deviations of a clicked pose, m and rad."""


def cost_image(grid: Grid) -> CellGrid:
    """Convert costs of -1 (unknown) and 0 to 100 to uint8 cells of 255 and 0 to 254."""
    # 255 is unknown; known costs are scaled to 0..254.
    costs = np.where(grid.cells < 0, 255, grid.cells.astype(np.int16) * 254 // 100).astype(np.uint8)
    return CellGrid(costs, grid.resolution, grid.origin_x, grid.origin_y)


def path_points(path: Path, frame: SE2) -> NDArray[np.float64]:
    """Return the points of a path, (n, 2), transformed from `frame` to the map."""
    points = [(stamped.pose.position.x, stamped.pose.position.y) for stamped in path.poses]
    return frame.apply(np.array(points, np.float64).reshape(-1, 2))


def clicked_pose(clicked: PoseStamped) -> PoseWithCovarianceStamped:
    """Return a pose that the operator has clicked on the map, with its covariance."""
    covariance = covariance_36(np.diag([CLICK_STD_XY**2, CLICK_STD_XY**2, CLICK_STD_YAW**2]))
    return PoseWithCovarianceStamped(clicked.header, PoseWithCovariance(clicked.pose, covariance))


def navigation_reason(status: NavigationStatus | None, *, exploring: bool) -> str:
    """Return why the navigation holds or has ended a goal; the explorer itself cancels goals that are mapped."""
    if status is None or (exploring and status.reason in NO_FAILURE):
        return ""
    return status.reason


def people_views(message: TrackedPeople, frame: SE2) -> tuple[PersonView, ...]:
    """Return people for the map; `frame` is the pose of the message's frame in it."""
    return tuple(_person_view(person, frame) for person in message.people)


def _person_view(person: TrackedPerson, frame: SE2) -> PersonView:
    at = frame @ SE2(person.position.x, person.position.y, 0.0)
    velocity = SE2(0.0, 0.0, frame.yaw) @ SE2(person.velocity.x, person.velocity.y, 0.0)
    deviation = math.sqrt(max(float(person.covariance[0]), float(person.covariance[5])))
    return PersonView(
        id=person.id,
        x=round(at.x, 2),
        y=round(at.y, 2),
        vx=round(velocity.x, 2),
        vy=round(velocity.y, 2),
        deviation=round(deviation, 2),
        visible=person.visible,
    )


def zone_views(zones: MapZones) -> tuple[ZoneView, ...]:
    """Convert the zones of the map."""
    return tuple(
        ZoneView(
            title=zone.title,
            name=zone.name,
            kind=zone.kind,
            corners=tuple((corner.x, corner.y) for corner in zone.corners),
            direction=zone.direction,
            speed=zone.speed,
        )
        for zone in zones.zones
    )


def door_views(doors: JointState | None) -> tuple[DoorView, ...]:
    """Convert the openings of doors, 0 closed .. 1 open; empty without a message or without positions."""
    if doors is None:
        return ()
    openings = zip(doors.name, doors.position.tolist(), strict=False)  # JointState may omit positions
    return tuple(DoorView(name, opening > 0.0) for name, opening in openings)


class RecentDiagnostics:
    """Diagnostics that are not OK, by name and hardware, with the time at which each was received."""

    def __init__(self) -> None:
        self._received: dict[tuple[str, str], tuple[int, str]] = {}
        """Time and message by name and hardware."""

    def update(self, message: DiagnosticArray, now_ns: int) -> None:
        """Store a message's diagnostics; those that are OK again are removed."""
        for entry in message.status:
            key = (entry.name, entry.hardware_id)
            self._received.pop(key, None)
            if entry.level != OK:
                self._received[key] = (now_ns, entry.message)

    def warnings(self, now_ns: int) -> tuple[str, ...]:
        """Return the diagnostics that were received recently, as sentences for the operator, each once.

        In the order of their names, so that they keep their places when they are repeated. A message that names its
        subject, as "The lidar is silent", appears once, with the name of the first node that reports it.
        """
        recent = sorted(item for item in self._received.items() if now_ns - item[1][0] < DIAGNOSTICS_AGE_NS)
        texts: dict[str, str] = {}
        for (name, _), (_, message) in recent:
            text = f"{name[:1].upper()}{name[1:]}: {message}"
            texts.setdefault(message if message.startswith("The ") else text, text)
        return tuple(texts.values())

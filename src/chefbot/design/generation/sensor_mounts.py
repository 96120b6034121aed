"""Sensors of a generated robot, mounted where the body does not block them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import msgspec

from chefbot.design.generation.parameters import BOTH, CAMERA, LIDAR
from chefbot.design.sizing.dependent_dimensions import plate_radius
from chefbot.robot.geometry import layout
from chefbot.robot.section import Housing, Mount, Offset, Size
from chefbot.robot.sensors import DepthCamera, ImuSpec, Lidar, Sensors, Ultrasonic
from chefbot.robot.spec import Robot

HOUSING_CLEARANCE = 0.003
"""Distance of a housing from plates and from the edge, m."""
ABOVE_BOXES = {1: 0.10, 2: 0.04}
"""Height above a plate that its equipment may take, m: the catalogue's highest battery, and the computer."""
RANGER_HEIGHT = 0.03
"""Height above the base plate that the ultrasonic ranger takes, m."""
IMU_HEIGHT = 0.022
"""Height of the IMU above the base plate, m: over the motor board."""
RANGER_SIDE = 0.06
"""y of the ultrasonic ranger, m: beside the lidar or camera that stands at the front."""
CAMERA_PIXELS = (320, 240)
CAMERA_HOUSING = Housing(size=Size(x=0.025, y=0.09, z=0.025), mass=0.072, centre=Offset(x=-0.0125))
LIDAR_HOUSING = Housing(size=Size(x=0.05, y=0.05, z=0.04), mass=0.13, centre=Offset(z=-0.008))
LIDAR_RANGE_MIN = 0.05
"""Minimum range of a lidar that sees nothing of the robot, m."""


class _Bay(NamedTuple):
    """Free heights between two plates, m."""

    low: float
    high: float

    def mount(self, housing: Housing, share: float) -> float:
        """Return the height of a sensor's frame at a share of the heights at which its housing fits."""
        half = housing.size.z / 2.0
        low, high = self.low + half - housing.centre.z, self.high - half - housing.centre.z
        return round(low + share * max(high - low, 0.0), 3)


def sensors_of(robot: Robot, n: Mapping[str, float]) -> Sensors:
    """Return the sensors with the drawn numbers; `robot` has its plates already."""
    lidar_bay = int(n["sensor_bay"])
    camera_bay = 3 - lidar_bay if n["obstacle_sensors"] == BOTH else lidar_bay
    return Sensors(
        imu=_imu(robot, n),
        ultrasonic=_ultrasonic(robot) if n["ultrasonic"] else None,
        depth_camera=_camera(robot, n, camera_bay) if n["obstacle_sensors"] in (CAMERA, BOTH) else None,
        lidar=_lidar(robot, n, lidar_bay) if n["obstacle_sensors"] in (LIDAR, BOTH) else None,
    )


def _bay(robot: Robot, plate: int, taken: float) -> _Bay:
    return _Bay(
        layout.plate_top(robot, plate) + taken + HOUSING_CLEARANCE,
        layout.plate_undersides(robot)[plate] - HOUSING_CLEARANCE,
    )


def _front(robot: Robot, housing: Housing, y: float = 0.0) -> float:
    """Return x of a frame at `y` whose housing ends at the edge of the plates, m."""
    front = math.sqrt((plate_radius(robot) - HOUSING_CLEARANCE) ** 2 - (y + housing.size.y / 2.0) ** 2)
    return round(front - housing.centre.x - housing.size.x / 2.0, 4)


def _imu(robot: Robot, n: Mapping[str, float]) -> ImuSpec:
    """Return the IMU above the motor board, as on the Chefbot."""
    imu = robot.sensors.imu
    mount = msgspec.structs.replace(imu.mount, z=round(layout.plate_top(robot, 1) + IMU_HEIGHT, 3))
    gyro_noise, gyro_bias = _radians(n["gyro_noise"]), _radians(n["gyro_bias"])
    return msgspec.structs.replace(imu, mount=mount, gyro_noise=gyro_noise, gyro_bias=gyro_bias)


def _ultrasonic(robot: Robot) -> Ultrasonic | None:
    """Return the template's ranger, low at the front; None if the template has none."""
    ranger = robot.sensors.ultrasonic
    if ranger is None:
        return None
    z = _bay(robot, 1, 0.0).mount(ranger.housing, 0.0)
    mount = Mount(x=_front(robot, ranger.housing, RANGER_SIDE), y=RANGER_SIDE, z=z)
    return msgspec.structs.replace(ranger, mount=mount)


def _camera(robot: Robot, n: Mapping[str, float], plate: int) -> DepthCamera:
    width, height = CAMERA_PIXELS
    z = _bay(robot, plate, RANGER_HEIGHT).mount(CAMERA_HOUSING, n["camera_height"])
    return DepthCamera(
        mount=Mount(x=_front(robot, CAMERA_HOUSING), z=z), housing=CAMERA_HOUSING, rate=n["camera_rate"],
        width=width, height=height, field_of_view=_radians(n["camera_field_of_view"]),
        range_min=n["camera_range_min"], range_max=n["camera_range"], noise=n["camera_noise"],
    )  # fmt: skip


def _lidar(robot: Robot, n: Mapping[str, float], plate: int) -> Lidar:
    """Return a lidar in the middle if it scans a full turn, else at the front; below it stands no equipment."""
    full = bool(n["lidar_full_turn"])
    angle = 360.0 if full else n["lidar_field_of_view"]
    ahead = not full and angle <= 180.0
    z = _bay(robot, plate, RANGER_HEIGHT if ahead else ABOVE_BOXES[plate]).mount(
        LIDAR_HOUSING, n["lidar_height"]
    )
    return Lidar(
        mount=Mount(x=0.0 if full else _front(robot, LIDAR_HOUSING), z=z), housing=LIDAR_HOUSING,
        rate=n["lidar_rate"], beams=round(angle / n["lidar_step"]) + (0 if angle == 360.0 else 1),
        field_of_view=_radians(angle), range_min=LIDAR_RANGE_MIN, range_max=n["lidar_range"],
        noise=n["lidar_noise"],
    )  # fmt: skip


def _radians(degrees: float) -> float:
    return 2.0 * math.pi if degrees == 360.0 else round(math.radians(degrees), 6)

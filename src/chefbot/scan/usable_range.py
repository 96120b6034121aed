"""What the mapping sensor's data are good for."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def trusted_range(robot: Robot, resolution: float) -> float:
    """Metres up to which the sensor that maps says in which cell of `resolution` metres a wall stands.

    A lidar's noise does not grow with range; a depth camera's grows with its square.
    """
    lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
    if lidar is not None or camera is None:
        return lidar.range_max if lidar is not None else 0.0
    return camera.range_with_noise(resolution)

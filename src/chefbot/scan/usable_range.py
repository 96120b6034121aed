"""The usable range of the mapping sensor."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def usable_range(robot: Robot, resolution: float) -> float:
    """Return the range, m, up to which the mapping sensor locates a wall within a cell of `resolution`
    metres.

    The noise of a lidar does not grow with range; that of a depth camera grows with its square.
    """
    lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
    if lidar is not None or camera is None:
        return lidar.range_max if lidar is not None else 0.0
    return camera.range_with_noise(resolution)

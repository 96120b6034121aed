"""Pictures of AprilTags as a pinhole camera sees them, and a robot with a colour camera."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.robot.load import load_robot
from chefbot.robot.section import Housing, Mount, Size
from chefbot.robot.sensors import ColorCamera, Lens, TagFamily, TagSpec
from chefbot.robot.spec import Robot
from chefbot.tags.family import tag_image

K = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])
"""Intrinsics of the pictures, of 640 x 480 pixels."""
SUBPIXELS, SQUARE_PIXELS = 8, 40
GROUND = 140
"""Grey level around the tags."""


def picture_of_tag(
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    family: TagFamily = "tag36h11",
    number: int = 7,
    size: float = 0.15,
) -> NDArray[np.uint8]:
    """Return the picture (480, 640, 3) of a tag whose frame has this pose in the optical frame; size: m."""
    squares = tag_image(family, number)
    n = len(squares)
    large = np.kron(np.pad(squares, 1, constant_values=255), np.ones((SQUARE_PIXELS,) * 2, np.uint8))
    half = size * (n + 2) / n / 2.0
    board = np.array([(-half, half, 0.0), (half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0)])
    side = (n + 2) * SQUARE_PIXELS - 0.5
    source = np.array([(-0.5, -0.5), (side, -0.5), (side, side), (-0.5, side)], np.float32)
    target = (project(board, rotation, translation) + 0.5) * SUBPIXELS - 0.5
    matrix = cv2.getPerspectiveTransform(source, target.astype(np.float32))
    fine = cv2.warpPerspective(large, matrix, (640 * SUBPIXELS, 480 * SUBPIXELS), borderValue=GROUND)
    grey = cv2.resize(fine, (640, 480), interpolation=cv2.INTER_AREA)
    return np.repeat(grey[:, :, np.newaxis], 3, axis=2)


def project(
    points: NDArray[np.float64], rotation: NDArray[np.float64], translation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the pixels (n, 2) of points (n, 3) of a frame with this pose in the optical frame."""
    image = (K @ (rotation @ points.T + translation[:, np.newaxis])).T
    pixels: NDArray[np.float64] = image[:, :2] / image[:, 2:]
    return pixels


def camera_robot(device: str = "auto", size: float = 0.2, lens: Lens | None = None) -> Robot:
    """Return the lidar robot with a colour camera ahead, whose tags have this size, m."""
    camera = ColorCamera(
        mount=Mount(x=0.12, z=0.16),
        housing=Housing(size=Size(x=0.025, y=0.07, z=0.03), mass=0.08),
        rate=10.0,
        width=640,
        height=480,
        field_of_view=1.13,
        driver="v4l2",
        device=device,
        lens=lens,
        tags=TagSpec(size=size),
    )
    robot = load_robot("chefbot_lidar")
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, color_camera=camera))

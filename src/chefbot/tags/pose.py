"""Pose of a tag from its corners (perspective-n-point).

Zhang: A flexible new technique for camera calibration, IEEE PAMI 22 (11), 2000, section 3.1: pose from the homography
of a plane; then the reprojection error is minimized (Levenberg-Marquardt). OpenCV's method for squares alone fails
where a tag faces the camera exactly.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.geometry_msgs import Quaternion, Transform, Vector3
from chefbot.tags.opencv import load_opencv

SQUARE = np.array([(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)])
"""Corners of a tag of size 1 in its own frame, in the order of `Tag.corners`: x right, y up, z towards the viewer."""


def tag_transform(
    corners: NDArray[np.float64], size: float, k: NDArray[np.float64], distortion: NDArray[np.float64]
) -> Transform | None:
    """Return the tag's frame in the optical frame of the camera (x right, y down, z forward), metres.

    corners: (4, 2) pixels, as of `Tag`. size: side of the black square, m. k: (3, 3) intrinsics. distortion: (4,) or
    (5,), plumb_bob. None if no pose fits.
    """
    cv2 = load_opencv("the pose of an AprilTag")
    method = cv2.SOLVEPNP_ITERATIVE
    found, rotation, translation = cv2.solvePnP(size * SQUARE, corners, k, distortion, flags=method)
    if not found or not np.isfinite(rotation).all() or not float(np.ravel(translation)[2]) > 0.0:
        return None
    return Transform(Vector3(*np.ravel(translation).tolist()), _quaternion(np.ravel(rotation)))


def _quaternion(rotation: NDArray[np.float64]) -> Quaternion:
    """Return the quaternion of a rotation vector (3,), whose length is the angle in rad."""
    angle = float(np.linalg.norm(rotation))
    scale = math.sin(angle / 2.0) / angle if angle > 0.0 else 0.5
    x, y, z = (scale * rotation).tolist()
    return Quaternion(x, y, z, math.cos(angle / 2.0))


def homography(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the homography (9,), row by row, from the square from (-1, -1) to (1, 1), y down, to the image."""
    cv2 = load_opencv("the homography of an AprilTag")
    square = 2.0 * SQUARE[:, :2] * (1.0, -1.0)
    matrix = cv2.getPerspectiveTransform(square.astype(np.float32), corners.astype(np.float32))
    flat: NDArray[np.float64] = np.ravel(matrix).astype(np.float64)
    return flat

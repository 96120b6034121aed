"""Detection of AprilTags in a picture.

Olson: AprilTag: A robust and flexible visual fiducial system, ICRA 2011. Wang & Olson: AprilTag 2, IROS 2016.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.sensors import TagFamily
from chefbot.tags.edges import refined_corners
from chefbot.tags.opencv import load_opencv

PIXEL_CENTRE = 0.5
"""Coordinates of the centre of the first pixel where OpenCV refines corners as AprilTag does; here it is (0, 0)."""
UPRIGHT_CORNERS = (1, 0, 3, 2)
"""Corners of OpenCV, clockwise from the upper left one, in the order of apriltag_ros, counter-clockwise from the
lower left one. OpenCV's images of tags are those of the AprilTag library turned by half a turn."""


class Tag(NamedTuple):
    """A tag in an image: its number, and its corners (4, 2), pixels, counter-clockwise from the lower left one."""

    id: int
    corners: NDArray[np.float64]


class TagDetector:
    """Finds the tags of one family; only tags whose bits are all right, which is safest with many false squares."""

    def __init__(self, family: TagFamily) -> None:
        """UserError if OpenCV is not installed."""
        self._cv2 = load_opencv(f"the detection of AprilTags ({family})")
        parameters = self._cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = self._cv2.aruco.CORNER_REFINE_APRILTAG
        parameters.errorCorrectionRate = 0.0
        self._detector = self._cv2.aruco.ArucoDetector(_dictionary(self._cv2, family), parameters)

    def detect(self, picture: NDArray[np.uint8]) -> list[Tag]:
        """Return the tags of a picture (h, w, 3), RGB, in order of their numbers, equal ones from the left."""
        grey = self._cv2.cvtColor(np.ascontiguousarray(picture), self._cv2.COLOR_RGB2GRAY)
        found, ids, _ = self._detector.detectMarkers(grey)
        rough = [one.reshape(4, 2).astype(np.float64) - PIXEL_CENTRE for one in found]
        corners = [refined_corners(grey, one) for one in rough]
        numbers = [] if ids is None else np.ravel(ids).tolist()
        tags = [Tag(*one) for one in zip(numbers, corners, strict=True)]
        tags.sort(key=lambda tag: (tag.id, *tag.corners.mean(axis=0).tolist()))
        return [Tag(tag.id, tag.corners[list(UPRIGHT_CORNERS)]) for tag in tags]


def tag_image(family: TagFamily, number: int) -> NDArray[np.uint8]:
    """Return a tag (n, n), a pixel for each of its squares, upright, with its black border and without the white one.

    ValueError for a number that the family does not have.
    """
    cv2 = load_opencv(f"an AprilTag ({family})")
    dictionary = _dictionary(cv2, family)
    n_tags = len(dictionary.bytesList)
    if not 0 <= number < n_tags:
        raise ValueError(f"family {family} has the tags 0 to {n_tags - 1}, not {number}")
    image = cv2.aruco.generateImageMarker(dictionary, number, dictionary.markerSize + 2)
    turned: NDArray[np.uint8] = np.ascontiguousarray(np.rot90(image, 2))
    return turned


def _dictionary(cv2: Any, family: TagFamily) -> Any:
    aruco = cv2.aruco
    return aruco.getPredefinedDictionary(getattr(aruco, f"DICT_APRILTAG_{family.removeprefix('tag')}"))

"""Detection of AprilTags in a picture.

Olson: AprilTag: A robust and flexible visual fiducial system, ICRA 2011. Wang & Olson: AprilTag 2, IROS 2016.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.sensors import TagFamily
from chefbot.tags.brightness import brightness_at
from chefbot.tags.decoding import read_squares
from chefbot.tags.edges import refined_corners
from chefbot.tags.family import patterns_of
from chefbot.tags.opencv import load_opencv
from chefbot.tags.pose import homography

CLOCKWISE_FROM_LOWER_LEFT = (3, 2, 1, 0)
"""Corners of OpenCV, clockwise from the upper left one, as those of apriltag_ros, counter-clockwise from the lower
left one."""
MIN_DISTANCE = 0.03
"""Distance of the corners of two squares, as a share of the side, below which they are the same: less than that
between the edges of the black and the white border."""
MAX_WRONG: dict[TagFamily, int] = {"tag16h5": 0, "tag25h9": 1, "tag36h10": 2, "tag36h11": 2}
"""Wrong squares with which a tag counts: few of what the family could correct, as many squares are no tags."""
MAX_WRONG_AT_FIRST: dict[TagFamily, int] = {"tag16h5": 1, "tag25h9": 3, "tag36h10": 6, "tag36h11": 6}
"""The same at corners that are a pixel off, where small tags are read badly; most other squares are left out."""
MAX_WRONG_BORDER = 2
"""Bright squares of the black border with which a square may be a tag."""
MIN_CONTRAST = 16.0
"""Difference in brightness of the white and the black border below which there is no tag, grey levels."""
SAME_CORNERS = 2.0
"""Distance between corners up to which they are the same, pixels."""


class Tag(NamedTuple):
    """A tag in an image.

    corners: (4, 2) pixels, counter-clockwise from the lower left one. homography: (9,), see `homography`. hamming:
    number of wrong squares. margin: mean distance of its squares' brightness from the threshold, grey levels.
    """

    id: int
    corners: NDArray[np.float64]
    homography: NDArray[np.float64]
    hamming: int
    margin: float

    def is_same(self, other: Tag) -> bool:
        """Return whether another tag is this one, found from another square around it."""
        return self.id == other.id and float(np.abs(self.corners - other.corners).max()) < SAME_CORNERS


class TagDetector:
    """Finds the tags of one family.

    OpenCV proposes squares. What is within them is compared with the tags; where one may be, the corners are fitted
    to the edges, and it is read again.
    """

    def __init__(self, family: TagFamily) -> None:
        """UserError if OpenCV is not installed."""
        self._cv2 = load_opencv(f"the detection of AprilTags ({family})")
        self._patterns = patterns_of(family)
        self._max_wrong_at_first, self._max_wrong = MAX_WRONG_AT_FIRST[family], MAX_WRONG[family]
        # OpenCV needs a dictionary, and compares each square with its tags: one tag is the least work.
        family_tags = self._cv2.aruco.getPredefinedDictionary(self._patterns.dictionary)
        one_tag = self._cv2.aruco.Dictionary(family_tags.bytesList[:1], family_tags.markerSize)
        parameters = self._cv2.aruco.DetectorParameters()
        parameters.minGroupDistance = parameters.minMarkerDistanceRate = MIN_DISTANCE
        self._detector = self._cv2.aruco.ArucoDetector(one_tag, parameters)
        brightness_at(np.zeros((1, 1), np.uint8), np.zeros(1), np.zeros(1))  # loads what it needs

    def detect(self, picture: NDArray[np.uint8]) -> list[Tag]:
        """Return the tags of a picture (h, w, 3), RGB, in order of their numbers, equal ones from the left."""
        grey = self._cv2.cvtColor(np.ascontiguousarray(picture), self._cv2.COLOR_RGB2GRAY)
        matched, _, others = self._detector.detectMarkers(grey)
        squares = [one.reshape(4, 2).astype(np.float64) for one in (*matched, *others)]
        tags: list[Tag] = []
        for tag in (tag for corners in squares for tag in self._read(grey, corners)):
            if not any(tag.is_same(other) for other in tags):
                tags.append(tag)
        return sorted(tags, key=lambda tag: (tag.id, *tag.homography[[2, 5]].tolist()))

    def _read(self, grey: NDArray[np.uint8], square: NDArray[np.float64]) -> Iterator[Tag]:
        """Yield the tag in a square, if there is one."""
        rough = square[list(CLOCKWISE_FROM_LOWER_LEFT)]
        number, turns, hamming = self._matched(grey, rough)[:3]
        if hamming > self._max_wrong_at_first:
            return
        # A tag that is turned clockwise has its lower left corner a corner farther clockwise.
        corners = refined_corners(grey, np.roll(rough, turns, axis=0))
        again, turns, hamming, margin = self._matched(grey, corners)
        if (again, turns) == (number, 0) and hamming <= self._max_wrong:
            yield Tag(number, corners, homography(corners), hamming, margin)

    def _matched(self, grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> tuple[int, int, int, float]:
        """Return number, quarter turns and wrong squares of the nearest tag, all squares if none is there; margin."""
        n = self._patterns.n
        reading = read_squares(grey, homography(corners), n)
        if reading.contrast < MIN_CONTRAST or reading.wrong_border > MAX_WRONG_BORDER:
            return 0, 0, n * n, 0.0
        return *self._patterns.nearest(reading.white), reading.margin

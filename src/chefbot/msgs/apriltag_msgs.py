"""apriltag_msgs: AprilTags in an image, as apriltag_ros publishes them."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Float32, Float64, Int32, Message, String
from chefbot.msgs.std_msgs import Header

Matrix33 = Annotated[NDArray[np.float64], "float64[9]"]
_ZERO_9 = np.zeros(9)
_ZERO_9.flags.writeable = False
MAX_DETECTIONS = 1000
"""Maximum number of tags in one image."""


class Point(Message, frozen=True, eq=False):
    """A point in an image, pixels; the centre of the first pixel is (0, 0)."""

    x: Float64 = 0.0
    y: Float64 = 0.0


class AprilTagDetection(Message, frozen=True, eq=False):
    """One tag: its family and number, the number of corrected bits, its centre, corners and homography.

    corners: counter-clockwise from the lower left one of the upright tag. homography: row by row, from the square
    with the corners (-1, -1) and (1, 1), y down, to the image. goodness, decision_margin: 0 if not measured.
    """

    family: String = ""
    id: Int32 = 0
    hamming: Int32 = 0
    goodness: Float32 = 0.0
    decision_margin: Float32 = 0.0
    centre: Point = Point()
    corners: Annotated[tuple[Point, ...], "4"] = (Point(),) * 4
    homography: Matrix33 = _ZERO_9


class AprilTagDetectionArray(Message, frozen=True, eq=False):
    """All tags in one image."""

    MAX_LENGTHS = per_field(detections=MAX_DETECTIONS)

    header: Header = Header()
    detections: tuple[AprilTagDetection, ...] = ()

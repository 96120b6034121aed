"""The tags of a family as patterns of squares, in the four ways that a square can be turned."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.sensors import TagFamily
from chefbot.tags.opencv import load_opencv


class NearestTag(NamedTuple):
    """The tag nearest to a pattern: its number, by how many quarter turns clockwise it is turned, wrong squares."""

    number: int
    turns: int
    hamming: int


class TagPatterns:
    """All tags of a family.

    OpenCV's pictures of tags are those of the AprilTag library, which users print, turned by half a turn.
    """

    def __init__(self, family: TagFamily) -> None:
        """UserError if OpenCV is not installed."""
        cv2 = load_opencv(f"AprilTags ({family})")
        self.dictionary = getattr(cv2.aruco, f"DICT_APRILTAG_{family.removeprefix('tag')}")
        known = cv2.aruco.getPredefinedDictionary(self.dictionary)
        self.n = int(known.markerSize)
        self.squares = _squares(cv2, known)
        turned = np.array([np.rot90(self.squares, -turns, axes=(1, 2)) for turns in range(4)])
        # (4 * tags, squares), -1 for black and 1 for white: a product with a pattern counts equal squares.
        self._signs = np.where(turned.reshape(4 * len(self.squares), -1), 1.0, -1.0).astype(np.float32)

    def nearest(self, white: NDArray[np.bool_]) -> NearestTag:
        """Return the tag that differs least from a pattern (n, n), the first of several."""
        signs = np.where(white.ravel(), 1.0, -1.0).astype(np.float32)
        agreement = self._signs @ signs
        best = int(agreement.argmax())
        turns, number = divmod(best, len(self.squares))
        return NearestTag(number, turns, round((len(signs) - float(agreement[best])) / 2.0))


def _squares(cv2: Any, dictionary: Any) -> NDArray[np.bool_]:
    """Return the data squares of all tags (tags, n, n), upright, whether they are white."""
    read, n = cv2.aruco.Dictionary.getBitsFromByteList, dictionary.markerSize
    bits = [read(row[np.newaxis], n) for row in dictionary.bytesList]
    squares: NDArray[np.bool_] = np.rot90(np.array(bits, bool), 2, axes=(1, 2))
    return squares


@lru_cache(maxsize=4)
def patterns_of(family: TagFamily) -> TagPatterns:
    """Return the tags of a family. UserError if OpenCV is not installed."""
    return TagPatterns(family)


def tag_image(family: TagFamily, number: int) -> NDArray[np.uint8]:
    """Return a tag (n, n), a pixel for each of its squares, upright, with its black border and without the white one.

    ValueError for a number that the family does not have.
    """
    squares = patterns_of(family).squares
    if not 0 <= number < len(squares):
        raise ValueError(f"family {family} has the tags 0 to {len(squares) - 1}, not {number}")
    return np.pad(np.where(squares[number], 255, 0).astype(np.uint8), 1)

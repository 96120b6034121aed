"""Constraints on the content of messages, such as ranges of numbers and consistent array sizes.

Each message type declares its own beside its fields (see `Message`); `validity.check` applies them to a message and
all nested messages. They are as strict as the meaning of a type allows and no stricter: real drivers may be off by
one beam, and leave fields unset.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Rule = Callable[[Any], str]
"""Returns what is wrong with a message, beginning with the field's name, or '' if it is valid."""
Bounds = tuple[float, float]
"""Lowest and highest value of a number, both included."""

MAX_MAGNITUDE = 1e6
"""Upper bound for positions, speeds and accelerations of an indoor robot, SI units."""
CORRELATION_TOLERANCE = 1e-6


def per_field(**values: T) -> dict[str, T]:
    """Return values by the name of the field."""
    return values


def within(low: float, high: float, *names: str) -> Rule:
    """Require that these fields lie between the bounds, both included; NaN does not."""

    def check(message: Any) -> str:
        for name in names:
            value = getattr(message, name)
            if not low <= value <= high:
                return f"{name} is {value:.6g}, it must lie between {low:g} and {high:g}"
        return ""

    return check


def ordered(low: str, high: str) -> Rule:
    """Require that the first field is not greater than the second."""

    def check(message: Any) -> str:
        a, b = getattr(message, low), getattr(message, high)
        return "" if a <= b else f"{low} is {a:.6g}, above {high}, which is {b:.6g}"

    return check


def same_length(name: str, *others: str, may_be_empty: bool = False) -> Rule:
    """Require that the other arrays have as many elements as the first.

    `may_be_empty`: an array may also be empty, which means "not measured".
    """

    def check(message: Any) -> str:
        size = len(getattr(message, name))
        for other in others:
            n = len(getattr(message, other))
            if n != size and not (may_be_empty and n == 0):
                return f"{other} has {n} elements, {name} has {size}"
        return ""

    return check


def max_length(limit: int, *names: str) -> Rule:
    """Require that these arrays have at most so many elements."""

    def check(message: Any) -> str:
        for name in names:
            n = len(getattr(message, name))
            if n > limit:
                return f"{name} has {n} elements, at most {limit} can be used"
        return ""

    return check


def min_length(minimum: int, *names: str) -> Rule:
    """Require that these arrays have at least so many elements."""

    def check(message: Any) -> str:
        for name in names:
            n = len(getattr(message, name))
            if n < minimum:
                return f"{name} has {n} elements, at least {minimum} are needed"
        return ""

    return check


def covariance(name: str, side: int, *, may_be_unknown: bool = False) -> Rule:
    """Require a covariance matrix: variances >= 0, symmetric, positive semidefinite.

    `may_be_unknown`: a first element of -1 means that the quantity is not measured (sensor_msgs/Imu).
    """

    def check(message: Any) -> str:
        matrix: NDArray[np.float64] = getattr(message, name).reshape(side, side)
        if may_be_unknown and matrix[0, 0] == -1.0:
            return ""
        variances = matrix.diagonal()
        if (variances < 0.0).any():
            return f"{name} holds the variance {variances.min():.6g}, which is below 0"
        # Cauchy-Schwarz: |cov(i, j)| <= sigma_i sigma_j
        sigma = np.sqrt(variances)
        scale = np.outer(sigma, sigma)
        if (np.abs(matrix) > scale * (1.0 + CORRELATION_TOLERANCE) ** 2).any():
            return f"{name} holds a covariance that is larger than its variances allow"
        if not np.count_nonzero(matrix) > np.count_nonzero(variances):
            return ""  # diagonal
        if (np.abs(matrix - matrix.T) > scale * CORRELATION_TOLERANCE).any():
            return f"{name} is not symmetric"
        # the correlations, so that units do not matter; what has no variance is uncorrelated
        correlation = np.divide(matrix, scale, out=np.eye(side), where=scale > 0.0)
        if np.linalg.eigvalsh(correlation)[0] < -side * CORRELATION_TOLERANCE:
            return f"{name} is not positive semidefinite"
        return ""

    return check

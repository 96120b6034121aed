"""Exponential and arc tangent from additions and multiplications only, equal on every processor.

The C library chooses its versions of these functions by the processor, and they differ in the last bit
(docs/decisions, 21). Accuracy matters less here: the errors are below 1e-6 and 2e-5.
"""

from __future__ import annotations

from numba import njit

PI = 3.141592653589793


@njit(cache=True, nogil=True)
def exp_minus(x: float) -> float:
    """Return exp(-x) for x >= 0."""
    if x > 40.0:
        return 0.0
    # exp(-x) = exp(-x / 64)^64, with a Taylor series of degree 7 in Horner's form.
    r = x * (1.0 / 64.0)
    y = 1.0 - r * (1.0 / 7.0)
    y = 1.0 - r * (1.0 / 6.0) * y
    y = 1.0 - r * (1.0 / 5.0) * y
    y = 1.0 - r * (1.0 / 4.0) * y
    y = 1.0 - r * (1.0 / 3.0) * y
    y = 1.0 - r * (1.0 / 2.0) * y
    y = 1.0 - r * y
    # Squared six times.
    y = y * y
    y = y * y
    y = y * y
    y = y * y
    y = y * y
    return y * y


@njit(cache=True, nogil=True)
def bearing(x: float, y: float) -> float:
    """Return the angle of the vector (x, y) to the x axis, -pi..pi rad; 0 for the vector 0."""
    ax, ay = abs(x), abs(y)
    high, low = max(ax, ay), min(ax, ay)
    if high == 0.0:
        return 0.0
    # Abramowitz & Stegun 4.4.49 for arguments of 0..1.
    z = low / high
    q = z * z
    angle = z * (0.9998660 + q * (-0.3302995 + q * (0.1801410 + q * (-0.0851330 + q * 0.0208351))))
    if ay > ax:
        angle = 0.5 * PI - angle
    if x < 0.0:
        angle = PI - angle
    return angle if y >= 0.0 else -angle

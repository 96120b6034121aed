"""The order of stops with the shortest route: exact dynamic programming over sets of stops.

Held and Karp, "A dynamic programming approach to sequencing problems", 1962.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MAX_STOPS = 12
"""Maximum number of stops; time and memory double with each one (12: 4096 sets)."""


def shortest_order(
    first: NDArray[np.float64], between: NDArray[np.float64], last: NDArray[np.float64]
) -> list[int]:
    """Return the order of n stops of the shortest route from a start over all of them to an end.

    first: lengths (n,) from the start to each stop. between: lengths (n, n) from stop i to stop j. last: lengths (n,)
    from each stop to the end. n is at most MAX_STOPS.
    """
    n = len(first)
    sets = np.arange(1 << n)
    size = sum((sets >> k) & 1 for k in range(n))
    length = np.full(
        (1 << n, n), np.inf
    )  # of the shortest route over a set of stops that ends at a stop of it
    before = np.zeros((1 << n, n), np.int64)  # the last but one stop of that route
    for k in range(n):
        length[1 << k, k] = first[k]
    for count in range(1, n):
        for k in range(n):
            known = sets[(size == count) & ((sets >> k) & 1 == 0)]
            extended = length[known] + between[:, k]
            before[known | 1 << k, k] = extended.argmin(axis=1)
            length[known | 1 << k, k] = extended.min(axis=1)
    return _backtrack(before, int((length[-1] + last).argmin()))


def _backtrack(before: NDArray[np.int64], end: int) -> list[int]:
    """Return the stops of the route over all stops that ends at `end`."""
    left, order = len(before) - 1, [end]
    while left != 1 << order[-1]:
        stop = order[-1]
        order.append(int(before[left, stop]))
        left ^= 1 << stop
    return order[::-1]

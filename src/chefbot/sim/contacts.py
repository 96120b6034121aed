"""Collision detection of the robot with the world."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.mjcf import HULL_GROUP
from chefbot.sim.world.floor import SLAB_NAME
from chefbot.sim.world.world_mjcf import PREFIX

EPISODE_GAP_NS = 500_000_000
"""A contact with the same object within half a second of the last one belongs to the same episode."""

NEVER_NS = -(10**18)
PERSON_NAME = re.compile(r"person_\d+$")
STANDSTILL_SPEED, STANDSTILL_TURN_RATE = 0.02, 0.05
"""Speeds in m/s and rad/s below which the robot stands."""


class Collisions(NamedTuple):
    """Collisions since the start of the simulation.

    episodes: number of contact episodes with anything but the floor. names: objects in order of first
    contact.
    """

    episodes: int
    names: tuple[str, ...]


class ContactMonitor:
    """Counts contact episodes from MuJoCo's list of geom pairs in contact.

    A contact with a person that begins while the robot stands is that person's fault and left out; `touching` names
    it.
    """

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self._walked_in: dict[str, int] = {}
        self._count = 0
        self.touching: tuple[str, ...] = ()

    def watch(self, model: Any) -> None:
        """Read the geoms of a newly compiled model."""
        names = [model.geom(i).name for i in range(model.ngeom)]
        self._names = [name.removeprefix(PREFIX).split("/")[0] for name in names]
        floor = [name == "floor" or name.startswith(PREFIX + SLAB_NAME) for name in names]
        self._robot: list[bool] = (model.geom_group == HULL_GROUP).tolist()
        self._obstacle = [not (r or f) for r, f in zip(self._robot, floor, strict=True)]

    def update(self, pairs: NDArray[np.int32], velocity: NDArray[np.float64], time_ns: int) -> None:
        """Update the episodes with the geom pairs (n, 2) that are in contact at `time_ns`.

        velocity: (6 or more,) of the robot's free joint, m/s and rad/s.
        """
        robot, obstacle, touched = self._robot, self._obstacle, set()
        # Obstacle geoms whose partner in the pair belongs to the robot; plain loop, as pairs are few.
        for a, b in pairs.tolist():
            if obstacle[a] and robot[b]:
                touched.add(self._names[a])
            elif obstacle[b] and robot[a]:
                touched.add(self._names[b])
        self.touching = tuple(sorted(touched))
        if not touched:
            return
        stands = (
            abs(velocity[0]) + abs(velocity[1]) < STANDSTILL_SPEED and abs(velocity[5]) < STANDSTILL_TURN_RATE
        )
        for name in self.touching:
            goes_on = time_ns - self._last.get(name, NEVER_NS) <= EPISODE_GAP_NS
            walked_in = stands or time_ns - self._walked_in.get(name, NEVER_NS) <= EPISODE_GAP_NS
            if PERSON_NAME.match(name) and not goes_on and walked_in:
                self._walked_in[name] = time_ns
                continue
            self._count += not goes_on
            self._last[name] = time_ns

    @property
    def collisions(self) -> Collisions:
        """Collisions since the start of the simulation."""
        return Collisions(self._count, tuple(self._last))

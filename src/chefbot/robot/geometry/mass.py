"""Mass, centre of mass and inertia of a robot, computed from its solids."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from chefbot.robot.geometry.shapes import MassProperties, mass_properties, transform_moments
from chefbot.robot.geometry.solids import link_origin, solids
from chefbot.robot.spec import Robot


@lru_cache(maxsize=64)
def link_mass_properties(robot: Robot, link: str) -> MassProperties:
    """Return the mass properties of all parts of a link, in the link's frame."""
    parts = [part for part in solids(robot) if part.link == link]
    return mass_properties((part.spread, part.mass / part.volume) for part in parts)


@lru_cache(maxsize=64)
def robot_mass_properties(robot: Robot) -> MassProperties:
    """Return the mass properties of the robot without payload, in base_link."""
    return mass_properties(
        (
            transform_moments(part.spread, np.eye(3), np.array(link_origin(robot, part.link))),
            part.mass / part.volume,
        )
        for part in solids(robot)
    )


def unloaded_mass(robot: Robot) -> float:
    """Return the mass of the robot without payload, kg."""
    return robot_mass_properties(robot).mass


def total_mass(robot: Robot) -> float:
    """Return the mass of the robot with payload, kg."""
    return unloaded_mass(robot) + robot.body.payload

"""The links of a description that have mass, read from URDF, MJCF and the solids."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any, NamedTuple

import mujoco
import numpy as np

from chefbot.design.export.links import links
from chefbot.robot.spec import Robot

PRECISION = 1e-6


class Body(NamedTuple):
    """kg; metres in the link's frame; kg m^2 about the centre as (3, 3)."""

    mass: float
    centre: np.ndarray
    tensor: np.ndarray


def tensor(ixx: float, iyy: float, izz: float, ixy: float, ixz: float, iyz: float) -> np.ndarray:
    """(3, 3) from URDF's six."""
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def of_solids(robot: Robot) -> dict[str, Body]:
    """As the robot's solids have it."""
    return {
        link.name: Body(link.inertia.mass, np.array(link.inertia.centre), tensor(*link.inertia.inertia))
        for link in links(robot)
    }


def of_urdf(text: str) -> dict[str, Body]:
    """As a URDF's text has it."""
    found = {}
    for link in ET.fromstring(text).iter("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass, origin, inertia = (inertial.find(tag) for tag in ("mass", "origin", "inertia"))
        assert mass is not None and origin is not None and inertia is not None
        six = [float(inertia.attrib[key]) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        centre = np.array([float(word) for word in origin.attrib["xyz"].split()])
        found[link.attrib["name"]] = Body(float(mass.attrib["value"]), centre, tensor(*six))
    return found


def of_mujoco(model: Any) -> dict[str, Body]:
    """As MuJoCo compiled it."""
    found = {}
    for i in range(1, model.nbody):
        if model.body_mass[i] > 0.0:
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, model.body_iquat[i])
            axes = turn.reshape(3, 3)
            spread = axes @ np.diag(model.body_inertia[i]) @ axes.T
            found[model.body(i).name] = Body(model.body_mass[i], model.body_ipos[i].copy(), spread)
    return found


def assert_same(found: dict[str, Body], expected: dict[str, Body]) -> None:
    """Equal within PRECISION: of the mass, of the largest moment, and of a metre."""
    assert set(found) == set(expected)
    for name, one in expected.items():
        other = found[name]
        assert abs(other.mass - one.mass) <= PRECISION * one.mass, name
        assert np.abs(other.centre - one.centre).max() <= PRECISION * max(np.abs(one.centre).max(), 1e-3), (
            name
        )
        assert np.abs(other.tensor - one.tensor).max() <= PRECISION * np.abs(one.tensor).max(), name

"""Faults of the wheels in MuJoCo: less friction, a blocked joint, a force on the robot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.mjcf import PHYSICS_STEP

BLOCKING_TORQUE = 1000.0
"""Friction of a blocked wheel, N m: more than any motor has."""
SHOVE_STEPS = round(0.1 / PHYSICS_STEP)
"""Physics steps over which a shove lasts."""
SIDES = ("left", "right")


class WheelFaults:
    """Faults of the wheels and shoves; each pair is (left, right)."""

    def __init__(self) -> None:
        self.friction: NDArray[np.float64] = np.ones(2)
        """Share of each tyre's friction that is left."""
        self.slipped = False
        """Whether a tyre's friction has ever been changed, so that it has to be written again."""
        self._stalled = (False, False)
        self._force: NDArray[np.float64] = np.zeros(3)
        self._steps_left = 0

    @property
    def shoving(self) -> bool:
        """Whether a force has to be set in the next step."""
        return self._steps_left > 0

    def install(self, model: Any) -> None:
        """Set the blocked wheels in a newly compiled model."""
        self._model, self._body = model, model.body("base_link").id
        joints = [model.jnt_dofadr[model.actuator_trnid[motor, 0]] for motor in range(model.nu)]
        self._dofs = np.array(joints)
        self._joint_friction = model.dof_frictionloss[self._dofs].copy()
        self.stall(self._stalled)

    def slip(self, friction: tuple[float, float]) -> None:
        """Set the share of each tyre's friction that is left."""
        self.friction = np.array(friction)
        self.slipped = self.slipped or friction != (1.0, 1.0)

    def stall(self, stalled: tuple[bool, bool]) -> None:
        """Block wheels or free them."""
        self._stalled = stalled
        blocked = np.array(stalled)
        self._model.dof_frictionloss[self._dofs] = np.where(blocked, BLOCKING_TORQUE, self._joint_friction)

    def shove(self, impulse: float, direction: float) -> None:
        """Push the robot's centre of mass for 0.1 s: impulse in N s, direction in the world, rad."""
        force = impulse / (SHOVE_STEPS * PHYSICS_STEP)
        self._force = force * np.array([math.cos(direction), math.sin(direction), 0.0])
        self._steps_left = SHOVE_STEPS + 1

    def shove_once(self, data: Any) -> None:
        """Set the force of the next physics step; after the last one it is zero."""
        self._steps_left -= 1
        data.xfrc_applied[self._body, :3] = self._force if self._steps_left else 0.0

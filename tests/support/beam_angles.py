"""Beam angles of a lidar and of a depth camera for tests."""

from __future__ import annotations

import math

import numpy as np

LIDAR = np.linspace(-math.pi, math.pi, 240, endpoint=False).astype(np.float32)
CAMERA = np.radians(np.linspace(-29, 29, 320)).astype(np.float32)

"""Generates random messages of any type that the codec can encode, with plausible and absurd values."""

from __future__ import annotations

import math
from typing import Any, TypeVar, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
)
from chefbot.msgs.idl.fields import NUMPY_TYPES, MessageField, fields_of
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid, Path
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header

M = TypeVar("M", bound=Message)
FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-300, 5e-324, 1e5, -1e6, 1e9, -1e12, 1e18, 3e38, 1e200, -1e308, 1.7e308)
NON_FINITE = (math.inf, -math.inf, math.nan)
TEXTS = (
    *("", "map", "odom", "base_link", "base_footprint", "laser", "camera_depth_optical_frame", "home"),
    *(
        "kitchen",
        "table_1",
        "open door",
        "☃" * 40,
        "a" * 5000,
        "../../etc",
        "line\nline\0end",
        "32FC1",
        "16UC1",
    ),
)
LENGTHS = (0, 1, 2, 3, 9, 36, 100, 360, 1000, 5000)
AT_LIMIT = 0.3
"""Share of the numbers with bounds that are at one of them."""
LONG_ARRAYS = 0.1
"""Share of the arrays of messages that may have more than two elements."""
PLAUSIBLE = 0.85
"""Share of the fields whose value is plausible."""


class MessageGenerator:
    """Generates random messages and mutates given ones; the same seed gives the same messages."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def generate(self, kind: type[M]) -> M:
        """Return a message with random fields; for some types half of the messages have consistent fields."""
        if self._rng.random() < 0.5:
            message = self._consistent(kind)
            if message is not None:
                return self.mutate(cast(M, message)) if self._rng.random() < 0.5 else cast(M, message)
        return kind(*(self._limit(kind, field) or self._value(field) for field in fields_of(kind)))

    def _limit(self, kind: type[Message], field: MessageField) -> Any:
        """Return, for most of the numbers with bounds, one of the bounds or a number between them; else None."""
        limits = kind.BOUNDS.get(field.name)
        if limits is None or field.is_array or self._rng.random() > PLAUSIBLE:
            return None
        if self._rng.random() < AT_LIMIT:
            return limits[self._rng.integers(2)]
        inside = self._rng.uniform(*limits)
        return inside if field.element.startswith("float") else int(inside)

    def mutate(self, message: M) -> M:
        """Return a copy in which one field, at any depth, has another value, mostly an absurd one."""
        fields = fields_of(type(message))
        field = fields[self._rng.integers(len(fields))]
        old = getattr(message, field.name)
        if field.message is not None and not field.is_array:
            new: Any = self.mutate(old)
        elif field.message is not None and len(old) and self._rng.random() < 0.8:
            i = int(self._rng.integers(len(old)))
            new = (*old[:i], self.mutate(old[i]), *old[i + 1 :])
        elif isinstance(old, np.ndarray) and len(old) and self._rng.random() < 0.7:
            new = old.copy()
            new[self._rng.integers(len(old))] = self._number(field.element, 0.1)
        else:
            new = self._limit(type(message), field) or self._value(field, 0.2)
        return msgspec.structs.replace(message, **{field.name: new})

    def _value(self, field: MessageField, plausible: float = PLAUSIBLE) -> Any:
        if field.is_array:
            return self._array(field, plausible)
        if field.message is not None:
            return self.generate(field.message)
        if field.element == "string":
            return self._pick(TEXTS)
        return self._number(field.element, plausible)

    def _array(self, field: MessageField, plausible: float) -> Any:
        n = field.fixed_size or int(self._pick(LENGTHS))
        n = min(n, field.bound or n)
        if field.message is not None:
            n = min(
                n, 20 if self._rng.random() < LONG_ARRAYS else 2
            )  # one absurd field has the message rejected
            return tuple(self.generate(field.message) for _ in range(n))
        if field.element == "string":
            return tuple(self._pick(TEXTS) for _ in range(min(n, 20)))
        return self._numbers(field.element, n, plausible)

    def _numbers(self, element: str, n: int, plausible: float) -> NDArray[Any]:
        """Return an array of shape (n,): one number throughout, random ones, or positive ones with some absurd."""
        dtype = NUMPY_TYPES[element]
        if self._rng.random() < 0.3:
            return np.full(n, self._number(element, plausible), dtype)
        if element.startswith("float"):
            values = self._rng.uniform(0.0, 5.0, n)
            odd = self._rng.random(n) < 0.2 * (1.0 - plausible)
            values[odd] = [self._number(element, 0.0) for _ in range(int(odd.sum()))]
            return values.astype(dtype)
        return np.array([self._number(element, plausible) for _ in range(min(n, 100))], dtype)

    def _number(self, element: str, plausible: float) -> Any:
        if element == "bool":
            return bool(self._rng.random() < 0.5)
        if element.startswith("float"):
            return self._float(element, plausible)
        info = np.iinfo(np.dtype(NUMPY_TYPES[element]))
        if self._rng.random() < plausible:
            return int(self._rng.integers(0, min(20, info.max)))
        return int(self._pick((info.min, info.max, 0, info.max // 2, info.min // 2 + 1)))

    def _float(self, element: str, plausible: float) -> float:
        if self._rng.random() < plausible:
            return float(np.float32(self._rng.normal(0.0, 2.0)))
        absurd = self._pick(NON_FINITE if self._rng.random() < 0.2 else FLOATS)
        with np.errstate(over="ignore", under="ignore"):
            return float(np.float32(absurd)) if element == "float32" else float(absurd)

    def _pick(self, values: tuple[Any, ...]) -> Any:
        return values[self._rng.integers(len(values))]

    # -- messages of types whose fields depend on each other

    def _consistent(self, kind: type[Message]) -> Message | None:
        generators = {
            Quaternion: self._quaternion,
            LaserScan: self._scan,
            ObstacleScan: self._obstacles,
            OccupancyGrid: self._grid,
            Image: self._image,
            PoseWithCovariance: self._pose_with_covariance,
            TwistWithCovariance: self._twist_with_covariance,
            Path: self._path,
        }
        return generators[kind]() if kind in generators else None

    def _quaternion(self) -> Quaternion:
        return Quaternion.of_yaw(float(self._rng.uniform(-4.0, 4.0)))

    def _covariance(self) -> NDArray[np.float64]:
        """Return a covariance matrix (36,) with variances from 1e-12 to 1e12, some of them zero."""
        root = np.tril(self._rng.normal(size=(6, 6)))
        root *= 10.0 ** self._rng.uniform(-6.0, 5.5, (6, 1)) * (self._rng.random((6, 1)) < 0.9)
        matrix: NDArray[np.float64] = root @ root.T
        return (0.5 * (matrix + matrix.T)).reshape(36)

    def _pose_with_covariance(self) -> PoseWithCovariance:
        return PoseWithCovariance(self.generate(Pose), self._covariance())

    def _twist_with_covariance(self) -> TwistWithCovariance:
        return TwistWithCovariance(self.generate(Twist), self._covariance())

    def _path(self) -> Path:
        steps = self._rng.normal(0.0, float(self._pick((0.01, 0.1, 10.0))), (int(self._pick(LENGTHS[:7])), 2))
        header = self.generate(Header)
        poses = [Pose(Point(x, y), self._quaternion()) for x, y in steps.cumsum(axis=0).tolist()]
        return Path(header, tuple(PoseStamped(header, pose) for pose in poses))

    def _ranges(self, n: int) -> NDArray[np.float32]:
        return self._numbers("float32", n, 0.5)

    def _scan(self) -> LaserScan:
        n = int(self._pick(LENGTHS[1:]))
        span = float(self._rng.uniform(0.1, 6.3)) * float(self._pick((1.0, -1.0)))
        low, step = float(self._rng.uniform(-4.0, 4.0)), span / max(n - 1, 1)
        near, far = 0.0, float(self._pick((0.1, 4.0, 12.0, 1e5)))
        return LaserScan(
            self.generate(Header), low, low + step * (n - 1), step, 0.0, 0.1, near, far, self._ranges(n)
        )

    def _obstacles(self) -> ObstacleScan:
        n = int(self._pick(LENGTHS[1:]))
        low, step = float(self._rng.uniform(-4.0, 4.0)), float(self._rng.uniform(-6.0, 6.0)) / n
        arrays = [self._ranges(n) for _ in range(5)]
        return ObstacleScan(self.generate(Header), low, step, float(self._pick((4.0, 1e5))), *arrays)

    def _grid(self) -> OccupancyGrid:
        width, height = (int(self._pick((1, 2, 10, 99, 300))) for _ in range(2))
        info = msgspec.structs.replace(
            self.generate(MapMetaData),
            width=width,
            height=height,
            resolution=float(self._pick((0.05, 0.001, 1.0, 99.0))),
        )
        cells = self._rng.choice(
            np.array([-1, 0, 100], np.int8), width * height, p=self._rng.dirichlet(np.ones(3))
        )
        return OccupancyGrid(self.generate(Header), info, cells)

    def _image(self) -> Image:
        encoding, size = self._pick((("32FC1", 4), ("16UC1", 2), ("rgb8", 3), ("mono8", 1), ("bayer", 1)))
        width, height = (int(self._pick((0, 1, 2, 64, 240, 320, 640))) for _ in range(2))
        data = self._rng.integers(0, 256, width * height * size, np.uint8)
        return Image(self.generate(Header), height, width, encoding, 0, width * size, data)

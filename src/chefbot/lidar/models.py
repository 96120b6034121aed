"""Lidars by the name that a robot file gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

from chefbot.lidar.ld19 import Ld19Session
from chefbot.lidar.rplidar import RplidarSession
from chefbot.lidar.session import LidarSession
from chefbot.lidar.ydlidar import YdlidarModel, YdlidarSession


class LidarModel(NamedTuple):
    """How to communicate with a lidar.

    maker: manufacturer and models, for display. baud: baud rate of the line. open: opens the protocol session on the
    port. dtr: level of the line DTR on which the adapter lets the motor run, None if it does not matter.
    """

    maker: str
    baud: int
    open: Callable[[], LidarSession]
    dtr: bool | None = None


def _ld19(maker: str, baud: int, sample_rate: float) -> LidarModel:
    return LidarModel(maker, baud, partial(Ld19Session, baud, sample_rate))


def _rplidar(maker: str, baud: int, sample_rate: float, dtr: bool | None = None) -> LidarModel:
    return LidarModel(maker, baud, partial(RplidarSession, baud, 1e9 / sample_rate), dtr)


def _ydlidar(maker: str, model: YdlidarModel, dtr: bool | None = None) -> LidarModel:
    return LidarModel(maker, model.baud, partial(YdlidarSession, model), dtr)


YDLIDARS: Mapping[str, YdlidarModel] = {
    "ydlidar_x2": YdlidarModel(115_200, 3000.0, 0, triangulates=True, one_way=True),
    "ydlidar_x4": YdlidarModel(128_000, 5000.0, 0, triangulates=True, one_way=False),
    "ydlidar_g2": YdlidarModel(230_400, 5000.0, 1, triangulates=True, one_way=False),
    "ydlidar_g4": YdlidarModel(230_400, 9000.0, 0, triangulates=True, one_way=False),
    "ydlidar_tmini": YdlidarModel(230_400, 4000.0, 1, triangulates=False, one_way=False),
}
LIDARS: Mapping[str, LidarModel] = {
    "ld06": _ld19("LDROBOT LD06", 230_400, 4500.0),
    "ld19": _ld19("LDROBOT LD19, D300 and D500 kit", 230_400, 4500.0),
    "stl19p": _ld19("LDROBOT STL-19P", 230_400, 5000.0),
    "stl27l": _ld19("LDROBOT STL-27L", 921_600, 21_600.0),
    # the motor of an A1 stands while DTR is asserted
    "rplidar_a1": _rplidar("Slamtec RPLIDAR A1", 115_200, 2000.0, dtr=False),
    "rplidar_a2": _rplidar("Slamtec RPLIDAR A2M8", 115_200, 2000.0, dtr=False),
    "rplidar_a2m12": _rplidar("Slamtec RPLIDAR A2M7 and A2M12", 256_000, 4000.0, dtr=False),
    "rplidar_a3": _rplidar("Slamtec RPLIDAR A3", 256_000, 4000.0, dtr=False),
    "rplidar_c1": _rplidar("Slamtec RPLIDAR C1", 460_800, 5000.0),
    "rplidar_s1": _rplidar("Slamtec RPLIDAR S1", 256_000, 9200.0),
    "rplidar_s2": _rplidar("Slamtec RPLIDAR S2", 1_000_000, 32_000.0),
    "rplidar_s3": _rplidar("Slamtec RPLIDAR S3", 1_000_000, 32_000.0),
    "ydlidar_x2": _ydlidar("YDLIDAR X2, X2L and X3", YDLIDARS["ydlidar_x2"]),
    # the motor of an X4 runs while DTR is asserted
    "ydlidar_x4": _ydlidar("YDLIDAR X4", YDLIDARS["ydlidar_x4"], dtr=True),
    "ydlidar_g2": _ydlidar("YDLIDAR G2", YDLIDARS["ydlidar_g2"]),
    "ydlidar_g4": _ydlidar("YDLIDAR G4", YDLIDARS["ydlidar_g4"]),
    "ydlidar_tmini": _ydlidar("YDLIDAR Tmini Pro", YDLIDARS["ydlidar_tmini"]),
}
"""Baud rates and sample rates: sllidar_ros2's launch files, ldlidar_stl_ros2 and YDLidar-SDK's doc/Dataset.md."""

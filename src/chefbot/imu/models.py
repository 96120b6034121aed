"""IMUs on a serial line by the name that a robot file gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

from chefbot.imu.bno085 import BAUD, Bno085Session
from chefbot.imu.session import ImuSession
from chefbot.imu.witmotion import WitMotionSession


class ImuModel(NamedTuple):
    """How to communicate with an IMU: its maker and models, for people, the baud rate, and its session."""

    maker: str
    baud: int
    open: Callable[[], ImuSession]


IMUS: Mapping[str, ImuModel] = {
    "bno085_rvc": ImuModel("BNO085 or BNO086 in the mode UART-RVC", BAUD, Bno085Session),
    "witmotion": ImuModel("WitMotion at 115200 baud", 115_200, partial(WitMotionSession, 115_200, 100.0)),
    # 22 bytes a sample: 960 bytes a second carry 43 samples
    "witmotion_9600": ImuModel("WitMotion at 9600 baud", 9_600, partial(WitMotionSession, 9_600, 20.0)),
}

"""What only the robot's own processes may publish: wheel speeds, and the map that its launch has."""

from __future__ import annotations

import numpy as np
from tests.support.bridged_loop import running
from tests.support.waiting import wait_for

from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext


def test_the_wheels_follow_local_processes_only(port: int) -> None:
    with running(port, "wheels") as one:
        obeyed = one.subscribe("/obeyed", Float64)
        stranger = one.outsider.publisher("/wheel_speeds", WheelSpeeds)
        one.wait_until_joined(stranger, "wheels", "obeyed")
        refused = "/wheel_speeds: /outsider may not publish this"

        def is_refused() -> bool:
            stranger.publish(
                WheelSpeeds(left=1.0)
            )  # a first message may be lost on the way to a subscriber just found
            return any(reason.startswith(refused) for reason in one.wire.rejected.counts())

        wait_for(is_refused)
        with (
            RmwContext(port=port, router=False) as other,
            RmwNode(other, "chefbot_drive"),
            RmwNode(other, "base") as node,
        ):
            base = node.publisher("/wheel_speeds", WheelSpeeds)
            wait_for(lambda: base.has_subscribers)

            def is_obeyed() -> bool:
                base.publish(WheelSpeeds(left=2.0))  # its token may come after its first messages
                return not obeyed.empty()

            wait_for(is_obeyed)
        assert obeyed.get().data == 2.0


def test_a_second_map_is_refused_with_a_notice(port: int) -> None:
    with running(port, "map_server", "map_user") as one:
        notices: list[str] = []
        one.system.loop.add_observer(
            lambda one: notices.append(one.message.data) if one.topic == "wire/notice" else None
        )
        stranger = one.outsider.publisher("/map", OccupancyGrid, TRANSIENT_LOCAL_QOS)
        # both know of each other: a map from nobody known might be the robot's own
        wait_for(lambda: stranger.has_subscribers and one.bridge._proxies.foreign_publishers("map"))
        stranger.publish(
            OccupancyGrid.of(Header.of(0, "map"), Grid(np.zeros((2, 2), np.int8), 0.05, 0.0, 0.0))
        )
        sentence = "/map: /outsider may not publish this: only the robot's own launch; stop one of them"
        wait_for(lambda: notices)
        assert notices == [f"Warning: message rejected: {sentence}."]

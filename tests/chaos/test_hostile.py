"""Floods and nonsense from outside: counted, refused and named, while the base goes on commanding in time."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Float64
from chefbot.ros2.rmw.names import InterfaceType
from tests.chaos.launched import launched, tell, wait_for
from tests.support.waiting import in_time

FLOOD_HZ, SECONDS = 10_000, 3.0


@pytest.mark.slow
@pytest.mark.timed
def test_invalid_messages_are_reported_and_floods_delay_nothing() -> None:
    with launched("flooded.yaml", "headless:=true") as (one, node):
        came: list[float] = []
        offsets: list[float] = []
        named: dict[str, str] = {}

        def note(array: DiagnosticArray) -> None:
            named.update({v.key: v.value for status in array.status for v in status.values})

        def speeds(_: WheelSpeeds) -> None:
            came.append(time.monotonic())

        node.subscription("/wheel_speeds", WheelSpeeds, speeds)
        node.subscription("/base_offset", Float64, lambda said: offsets.append(said.data))
        node.subscription("/diagnostics", DiagnosticArray, note)
        teleop = node.publisher("/cmd_vel_teleop", Twist)
        stranger = node.raw_publisher(
            "/cmd_vel_nav", InterfaceType("geometry_msgs/msg/Twist", "RIHS01_" + "0" * 64)
        )
        wait_for(lambda: teleop.has_subscribers and len(came) > 40)
        teleop.publish(Twist.of(math.nan, 0.0))
        teleop.publish_cdr(Twist.of(0.1, 0.0).to_cdr()[:20])
        stranger.publish_cdr(Twist.of(0.1, 0.0).to_cdr())

        quiet = len(offsets)
        wait_for(lambda: len(offsets) > quiet + 40)
        began, sent, before = time.monotonic(), 0, len(came)
        quiet, calm = len(offsets), np.abs(np.diff(offsets[quiet:])) * 1e3
        while time.monotonic() - began < SECONDS:
            while sent < (time.monotonic() - began) * FLOOD_HZ:
                teleop.publish(Twist.of(0.0, 0.0))
                sent += 1
            time.sleep(0.001)
        seen = np.abs(np.diff(came[before:]) - 0.05) * 1e3
        late = np.abs(np.diff(offsets[quiet:])) * 1e3
        tell(
            f"{sent / SECONDS:.0f} Hz of commands; 20 Hz of the base off by {np.percentile(late, 99):.1f} ms (p99), "
            f"without them by {np.percentile(calm, 99):.1f} ms; from outside by {np.percentile(seen, 99):.1f} ms"
        )
        assert len(late) > 0
        assert in_time(float(np.median(late)), 25.0)  # half a period
        for word in ("nan", "/cmd_vel_teleop", "receive queue is full"):
            wait_for(lambda: any(word in key for key in named))  # noqa: B023
        wait_for(lambda: any("/cmd_vel_nav" in key + value for key, value in named.items()))
        tell("\n".join(f"{key}: {value}" for key, value in named.items() if "/cmd_vel" in key + value))
        one.stop()
        assert one.process.returncode == 0

"""Tests that invalid messages and message floods from the network are reported and do not delay the base."""

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
from tests.chaos.launch_process import report, run_launch_file, wait_for
from tests.support.waiting import in_time

FLOOD_HZ, SECONDS = 10_000, 3.0


@pytest.mark.rotated("invalid messages")
@pytest.mark.slow
@pytest.mark.timed
def test_invalid_messages_are_reported_and_floods_delay_nothing() -> None:
    with run_launch_file("message_flood.yaml", "headless:=true") as (chefbot, node):
        received: list[float] = []
        offsets: list[float] = []
        diagnostics: dict[str, str] = {}

        def keep(array: DiagnosticArray) -> None:
            diagnostics.update({v.key: v.value for status in array.status for v in status.values})

        def speeds(_: WheelSpeeds) -> None:
            received.append(time.monotonic())

        node.subscription("/wheel_speeds", WheelSpeeds, speeds)
        node.subscription("/base_offset", Float64, lambda offset: offsets.append(offset.data))
        node.subscription("/diagnostics", DiagnosticArray, keep)
        teleop = node.publisher("/cmd_vel_teleop", Twist)
        other_type = node.raw_publisher(
            "/cmd_vel_nav", InterfaceType("geometry_msgs/msg/Twist", "RIHS01_" + "0" * 64)
        )
        wait_for(lambda: teleop.has_subscribers and len(received) > 40)
        teleop.publish(Twist.of(math.nan, 0.0))
        teleop.publish_cdr(Twist.of(0.1, 0.0).to_cdr()[:20])
        other_type.publish_cdr(Twist.of(0.1, 0.0).to_cdr())

        first = len(offsets)
        wait_for(lambda: len(offsets) > first + 40)
        began, sent, before = time.monotonic(), 0, len(received)
        first, baseline = len(offsets), np.abs(np.diff(offsets[first:])) * 1e3
        while time.monotonic() - began < SECONDS:
            while sent < (time.monotonic() - began) * FLOOD_HZ:
                teleop.publish(Twist.of(0.0, 0.0))
                sent += 1
            time.sleep(0.001)
        outside = np.abs(np.diff(received[before:]) - 0.05) * 1e3
        jitter = np.abs(np.diff(offsets[first:])) * 1e3
        report(
            f"{sent / SECONDS:.0f} Hz of commands; jitter of the base {np.percentile(jitter, 99):.1f} ms (p99), "
            f"without them {np.percentile(baseline, 99):.1f} ms; outside {np.percentile(outside, 99):.1f} ms"
        )
        assert len(jitter) > 0
        assert in_time(float(np.median(jitter)), 25.0)  # half a period
        for word in ("nan", "/cmd_vel_teleop", "receive queue is full"):
            wait_for(lambda: any(word in key for key in list(diagnostics)))  # noqa: B023
        wait_for(lambda: any("/cmd_vel_nav" in key + value for key, value in list(diagnostics.items())))
        report(
            "\n".join(
                f"{key}: {value}" for key, value in list(diagnostics.items()) if "/cmd_vel" in key + value
            )
        )
        chefbot.stop()
        assert chefbot.process.returncode == 0

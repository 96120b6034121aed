"""What a process of a launch received while it ran is restored after a `kill -9`."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.chaos.launch_process import run_chefbot, wait_for
from tests.support.bridged_loop import ready_client
from tests.support.waiting import PATIENCE

from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order, Place, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.rcl_interfaces import (
    DOUBLE,
    GetParameters,
    GetParameters_Request,
    Parameter,
    ParameterEvent,
    ParameterValue,
    SetParameters,
    SetParameters_Request,
)
from chefbot.msgs.std_msgs import Header
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import PARAMETERS, TRANSIENT_LOCAL_QOS

LAUNCH = """
description: A waiter and the gate before the wheels, in a process of their own.
clock: wall
nodes:
  odometry: {kind: "chefbot.nodes.odometry:OdometryNode"}
  base: {kind: "chefbot.nodes.drive_base:DriveBaseNode", process: service, params: {ultrasonic_margin: 0.1}}
  delivery: {kind: "chefbot.nodes.delivery:DeliveryNode", process: service}
"""
SET = {"teleop_hold": 2.5, "limiter.timeout": 0.25}


def get(node: RmwNode, *names: str) -> list[float]:
    client = ready_client(node, "/base/get_parameters", GetParameters)
    answer = client.call(GetParameters_Request(names), timeout=PATIENCE)
    return [one.double_value for one in answer.values]


def set_all(node: RmwNode) -> None:
    values = tuple(Parameter(name, ParameterValue(DOUBLE, double_value=value)) for name, value in SET.items())
    client = ready_client(node, "/base/set_parameters", SetParameters)
    answer = client.call(SetParameters_Request(values), timeout=PATIENCE)
    assert all(one.successful for one in answer.results)


def lie(node: RmwNode) -> None:
    """What no base can have accepted: it must not end the restarted process at its start."""
    events = node.publisher("/parameter_events", ParameterEvent, PARAMETERS)
    wait_for(lambda: events.has_subscribers)
    for name, value in (("no_such", 1.0), ("limiter.no.such", 1.0), ("teleop_hold", -7.0)):
        changed = (Parameter(name, ParameterValue(DOUBLE, double_value=value)),)
        events.publish(ParameterEvent(Time(), "/base", changed_parameters=changed))


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_parameters_and_orders_survive_a_process_restart(tmp_path: Path) -> None:
    path = tmp_path / "service.yaml"
    path.write_text(LAUNCH)
    with run_chefbot("launch", str(path)) as (one, node):
        statuses: list[DeliveryStatus] = []
        node.subscription("/delivery_status", DeliveryStatus, statuses.append, TRANSIENT_LOCAL_QOS)
        order = node.publisher("/order", Order)
        somewhere = PoseStamped(Header(frame_id="map"), Pose.of(IDENTITY))
        places = Places(tuple(Place(name, somewhere) for name in ("home", "kitchen", "table_1", "table_2")))
        node.publisher("/places", Places, TRANSIENT_LOCAL_QOS).publish(places)
        wait_for(lambda: order.has_subscribers and statuses)
        set_all(node)
        lie(node)
        for number in (1, 2):
            order.publish(Order((f"table_{number}",), str(number)))
            wait_for(lambda number=number: str(number) in statuses[-1].accepted)
        wait_for(lambda: statuses[-1].state == "driving")
        for _ in range(2):  # a second restart does not lose what the first process received
            count, killed = len(statuses), one.inject("killed", "service")
            wait_for(lambda: one.child("service") not in (None, killed))  # noqa: B023
            wait_for(lambda: len(statuses) > count and statuses[-1].state == "driving")  # noqa: B023
            assert (statuses[-1].place, statuses[-1].queue) == ("kitchen", ("table_1",))
            assert [one.places for one in statuses[-1].pending_orders] == [("table_2",)] and statuses[
                -1
            ].accepted == (
                "1",
                "2",
            )
            assert get(node, *SET, "ultrasonic_margin") == [*SET.values(), 0.1]

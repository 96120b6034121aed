"""The get_type_description service, without a network."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from chefbot.msgs.nav2_msgs import Spin
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Request,
    GetTypeDescription_Response,
)
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.type_description import serve_type_descriptions


def answer(request: GetTypeDescription_Request) -> GetTypeDescription_Response:
    servers: list[Any] = []
    node: Any = SimpleNamespace(server=lambda name, kind, callback: servers.append((name, kind, callback)))
    serve_type_descriptions(node)
    ((name, kind, callback),) = servers
    assert (name, kind) == ("~/get_type_description", GetTypeDescription)
    responses: list[GetTypeDescription_Response] = []
    callback(SimpleNamespace(request=request, respond=responses.append))
    (response,) = responses
    return response


def test_a_known_type_is_described_with_its_nested_types() -> None:
    kind = InterfaceType.of(LaserScan)
    response = answer(GetTypeDescription_Request(kind.name, kind.hash, False))
    assert response.successful and response.type_sources == ()
    description = response.type_description
    assert description.type_description.type_name == "sensor_msgs/msg/LaserScan"
    nested = [one.type_name for one in description.referenced_type_descriptions]
    assert nested == ["builtin_interfaces/msg/Time", "std_msgs/msg/Header"]


def test_sources_are_in_the_order_of_the_description() -> None:
    kind = InterfaceType.of(Spin)
    response = answer(GetTypeDescription_Request(kind.name, "", True))
    names = [response.type_description.type_description.type_name]
    names += [one.type_name for one in response.type_description.referenced_type_descriptions]
    assert [one.type_name for one in response.type_sources] == names
    encodings = {one.type_name: one.encoding for one in response.type_sources}
    assert encodings["nav2_msgs/action/Spin"] == "action"
    assert encodings["nav2_msgs/action/Spin_Goal"] == "implicit"


@pytest.mark.parametrize(
    ("name", "type_hash", "part"),
    [
        ("sensor_msgs/msg/LaserScan", "RIHS01_other", "is known with the hash"),
        ("their_msgs/msg/Thing", "", "their_msgs/msg/Thing"),
    ],
)
def test_other_versions_and_unknown_types_are_refused(name: str, type_hash: str, part: str) -> None:
    response = answer(GetTypeDescription_Request(name, type_hash, True))
    assert not response.successful and part in response.failure_reason

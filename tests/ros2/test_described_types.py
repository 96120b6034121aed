"""get_type_description, as a program calls it that does not have the types."""

from __future__ import annotations

from tests.support.bridged_loop import ready_client, running
from tests.support.waiting import PATIENCE

from chefbot.msgs.chefbot_msgs import Deliver
from chefbot.msgs.std_msgs import Float64
from chefbot.msgs.type_description_interfaces import GetTypeDescription, GetTypeDescription_Request
from chefbot.ros2.rmw.names import InterfaceType


def test_type_descriptions_are_served_on_request(port: int) -> None:
    with running(port, "cook") as one:
        client = ready_client(one.outsider, "/cook/get_type_description", GetTypeDescription)
        for kind in (InterfaceType.of(Float64), InterfaceType.of(Deliver)):
            answer = client.call(GetTypeDescription_Request(kind.name, kind.hash), PATIENCE)
            assert answer.successful
            assert answer.type_description.type_description.type_name == kind.name
        wrong = client.call(GetTypeDescription_Request("std_msgs/msg/Float64", "RIHS01_0"), PATIENCE)
        assert not wrong.successful and "hash" in wrong.failure_reason


def test_type_sources_are_included_on_request(port: int) -> None:
    """In the order of the description; types that rosidl makes of an action have no file."""
    with running(port, "cook") as one:
        client = ready_client(one.outsider, "/cook/get_type_description", GetTypeDescription)
        kind = InterfaceType.of(Deliver)
        response = client.call(GetTypeDescription_Request(kind.name, kind.hash, True), PATIENCE)
        described = response.type_description
        names = [described.type_description, *described.referenced_type_descriptions]
        assert [one.type_name for one in response.type_sources] == [one.type_name for one in names]
        sources = {one.type_name.rpartition("/")[2]: one for one in response.type_sources}
        assert sources["Deliver"].encoding == "action"
        assert sources["Deliver"].raw_file_contents.startswith("string[] places\n---\n")
        assert sources["Deliver"].raw_file_contents.count("---\n") == 2
        assert (sources["Deliver_Goal"].encoding, sources["Deliver_Goal"].raw_file_contents) == (
            "implicit",
            "",
        )
        assert sources["Time"].encoding == "msg"
        assert sources["Time"].raw_file_contents == "int32 sec\nuint32 nanosec\n"
        bare = client.call(GetTypeDescription_Request(kind.name, kind.hash, False), PATIENCE)
        assert bare.successful and bare.type_sources == ()

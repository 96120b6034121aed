"""Service types: a request, a response, and the service event for introspection."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Generic, NamedTuple, TypeVar

from chefbot.msgs.idl.definition import Description, compose, describe, description_hash
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Message, define_message
from chefbot.msgs.service_msgs import ServiceEventInfo

Q = TypeVar("Q", bound=Message)
S = TypeVar("S", bound=Message)


class Service(NamedTuple, Generic[Q, S]):
    """The message types of one service."""

    name: str
    """ROS name, such as 'std_srvs/srv/SetBool'."""
    request: type[Q]
    response: type[S]
    event: type[Message]

    @property
    def description(self) -> Description:
        """Type description of the service, as in type_description_interfaces."""
        parts = (("request_message", self.request), ("response_message", self.response))
        return compose(
            self.name, [(name, describe(kind)) for name, kind in (*parts, ("event_message", self.event))]
        )

    @property
    def type_hash(self) -> str:
        """Type hash 'RIHS01_...' of the service, part of its keys on the network."""
        return description_hash(self.description)


def define_service(request: type[Q], response: type[S]) -> Service[Q, S]:
    """Define a service by its two parts, which are named X_Request and X_Response."""
    name = request.__name__.removesuffix("_Request")
    module = request.__module__

    def optional(kind: type[Message]) -> Any:
        return Annotated[tuple[kind, ...], "<=1"]  # type: ignore[valid-type]

    fields = [
        ("info", ServiceEventInfo, ServiceEventInfo()),
        ("request", optional(request), ()),
        ("response", optional(response), ()),
    ]
    event = define_message(f"{name}_Event", fields, module, request.ROS_PACKAGE)
    setattr(sys.modules[module], event.__name__, event)
    return Service(ros_type(request).removesuffix("_Request"), request, response, event)

"""Services: a request, a response, and the event that ROS makes of both."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, cast

import msgspec

from chefbot.msgs.idl.definition import Description, compose, describe, description_hash
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.service_msgs import ServiceEventInfo

Q = TypeVar("Q", bound=Message)
S = TypeVar("S", bound=Message)


class Service(NamedTuple, Generic[Q, S]):
    """The types of one service."""

    name: str
    """'std_srvs/srv/SetBool'"""
    request: type[Q]
    response: type[S]
    event: type[Message]

    @property
    def description(self) -> Description:
        """As type_description_interfaces tells it."""
        parts = (("request_message", self.request), ("response_message", self.response))
        return compose(self.name, [(n, describe(one)) for n, one in (*parts, ("event_message", self.event))])

    @property
    def type_hash(self) -> str:
        """'RIHS01_...' of the service, which its topics carry."""
        return description_hash(self.description)


def define_service(request: type[Q], response: type[S]) -> Service[Q, S]:
    """The service whose parts are given; they are named X_Request and X_Response."""
    name = request.__name__.removesuffix("_Request")
    module = request.__module__

    def optional(kind: type[Message]) -> Any:
        return Annotated[tuple[kind, ...], "<=1"]  # type: ignore[valid-type]

    event: type[Message] = cast(
        type[Message],
        msgspec.defstruct(
            f"{name}_Event",
            [
                ("info", ServiceEventInfo, ServiceEventInfo()),
                ("request", optional(request), ()),
                ("response", optional(response), ()),
            ],
            bases=(Message,),
            module=module,
            namespace={"ROS_PACKAGE": request.ROS_PACKAGE},
            frozen=True,
            eq=False,
        ),
    )
    setattr(sys.modules[module], event.__name__, event)
    return Service(ros_type(request).removesuffix("_Request"), request, response, event)

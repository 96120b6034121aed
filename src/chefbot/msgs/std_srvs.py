"""std_srvs: services without arguments or with one boolean."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from chefbot.msgs.idl.message import Bool, Message, String, Uint8
from chefbot.msgs.idl.service import define_service


class Empty_Request(Message, frozen=True, eq=False):
    """A request without any content."""

    structure_needs_at_least_one_member: Uint8 = 0


class Empty_Response(Message, frozen=True, eq=False):
    """A response without any content."""

    structure_needs_at_least_one_member: Uint8 = 0


class SetBool_Request(Message, frozen=True, eq=False):
    """A request to switch something on or off."""

    data: Bool = False


class SetBool_Response(Message, frozen=True, eq=False):
    """Whether the request succeeded, and a message."""

    success: Bool = False
    message: String = ""


class Trigger_Request(Message, frozen=True, eq=False):
    """A request to trigger an action, without content."""

    structure_needs_at_least_one_member: Uint8 = 0


class Trigger_Response(Message, frozen=True, eq=False):
    """Whether the triggered action succeeded, and a message."""

    success: Bool = False
    message: String = ""


Empty = define_service(Empty_Request, Empty_Response)
SetBool = define_service(SetBool_Request, SetBool_Response)
Trigger = define_service(Trigger_Request, Trigger_Response)

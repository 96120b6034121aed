"""std_srvs: do it, switch it."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from chefbot.msgs.idl.message import Bool, Message, String, Uint8
from chefbot.msgs.idl.service import define_service


class Empty_Request(Message, frozen=True, eq=False):
    """Do it."""

    structure_needs_at_least_one_member: Uint8 = 0


class Empty_Response(Message, frozen=True, eq=False):
    """Done."""

    structure_needs_at_least_one_member: Uint8 = 0


class SetBool_Request(Message, frozen=True, eq=False):
    """Switch it on or off."""

    data: Bool = False


class SetBool_Response(Message, frozen=True, eq=False):
    """Whether it worked, or why not."""

    success: Bool = False
    message: String = ""


class Trigger_Request(Message, frozen=True, eq=False):
    """Do it."""

    structure_needs_at_least_one_member: Uint8 = 0


class Trigger_Response(Message, frozen=True, eq=False):
    """Whether it worked, or why not."""

    success: Bool = False
    message: String = ""


Empty = define_service(Empty_Request, Empty_Response)
SetBool = define_service(SetBool_Request, SetBool_Response)
Trigger = define_service(Trigger_Request, Trigger_Response)

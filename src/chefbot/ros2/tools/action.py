"""The commands `chefbot action list` and `send`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import CancelledError
from concurrent.futures import TimeoutError as NoTimeLeftError
from threading import Event
from typing import Any

from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED, STATUS_SUCCEEDED
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.editions import older_editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import action_type
from chefbot.msgs.idl.yaml_conversion import message_from_dict, message_to_dict
from chefbot.ros2.rmw.action_client import ActionClient, GoalHandle, GoalRejectedError
from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.service import NoResponseError
from chefbot.ros2.tools.common import (
    MAX_SHOWN_ELEMENTS,
    ToolError,
    console,
    errors,
    find,
    graph_node,
    local_definition,
    only_type,
    print_with_servers,
    stop_event,
    to_yaml,
    type_and_values,
    type_name,
)
from chefbot.ros2.tools.robot_clock import RobotClock

SERVED_WAIT, CANCEL_WAIT = 2.0, 5.0
"""Maximum time to find the server, and for a canceled goal to finish, s."""
SEND_GOAL = "_SendGoal"
"""Suffix of the type name of the send_goal service."""
ENDINGS = {STATUS_SUCCEEDED: "succeeded", STATUS_CANCELED: "cancelled", STATUS_ABORTED: "aborted"}


def run_list(verbose: bool) -> None:
    """Print one action name per line; with types and servers if `verbose`."""
    with graph_node("action") as node:
        print_with_servers(node.wire.graph.actions().values(), verbose)


def run_send(name: str, arguments: Sequence[str], quiet: bool) -> int:
    """Send a goal and print its feedback and result as YAML; Ctrl-C cancels it.

    Returns the exit code: 1 unless the goal succeeded.
    """
    type_given, values = type_and_values(arguments)
    with graph_node("action") as node, stop_event() as stop:
        named = find(node.wire.graph.actions, name, "action")
        action = _action(named)
        if type_given and type_name(type_given, "action") != action.ros_name:
            raise ToolError(f"action {named.name} is a {action.ros_name}, not a {type_given}")
        clock = RobotClock(node, named.name)
        goal = message_from_dict(action.goal, values, f"values for {named.name}", clock.now())
        client = ActionClient(node, named.name, action)
        deadline = time.monotonic() + SERVED_WAIT
        while not client.served and time.monotonic() < deadline:
            time.sleep(0.01)
        if not client.served:
            raise ToolError(
                f"action {named.name} is not within reach, or its results are of an unknown version"
            )
        handle = client.send_goal_async(goal, None if quiet else _show_feedback)
        return _await(handle, named.name, stop)


def _action(named: EndpointGroup) -> Action[Any, Any, Any]:
    """Return our definition of a served action in any version known here; raises ToolError when unknown."""
    kinds = [server.info.type for server in named.providers]
    kind = kinds[0] if len({kind.name for kind in kinds}) == 1 else only_type(named, "action")
    action_name = kind.name.removesuffix(SEND_GOAL)
    known = {version.send_goal_service.type_hash for version in older_editions(action_name)}
    if not any(kind.hash in known for kind in kinds):
        local_definition(kind, _send_goal, f"action {named.name}")
    return action_type(action_name)


def _send_goal(name: str) -> Any:
    """Return the send_goal service of an action; its hash identifies the version of the action."""
    return action_type(name.removesuffix(SEND_GOAL)).send_goal_service


def _show_feedback(feedback: Message) -> None:
    console.print(f"feedback:\n{_indented(feedback)}")


def _indented(message: Message) -> str:
    return "\n".join(
        f"  {line}" for line in to_yaml(message_to_dict(message, MAX_SHOWN_ELEMENTS)).splitlines()
    )


def _await(handle: GoalHandle, name: str, stop: Event) -> int:
    """Wait for the end of the goal, canceling it first when `stop` is set; return the exit code."""
    deadline: float | None = None
    while True:
        if stop.is_set() and deadline is None:
            errors.print(f"chefbot: cancelling {name}")
            handle.cancel()
            deadline = time.monotonic() + CANCEL_WAIT
        if deadline is not None and time.monotonic() > deadline:
            raise ToolError(f"{name} did not end in {CANCEL_WAIT:g} s after it was cancelled; it may go on")
        try:
            status, result = handle.result.result(timeout=0.05)
        except NoTimeLeftError:
            continue
        except GoalRejectedError:
            console.print(f"status: rejected; {name} rejected the goal, see /diagnostics for the reason")
            return 1
        except (NoResponseError, CancelledError) as error:
            raise ToolError(f"{name}: {error}") from None
        console.print(f"result:\n{_indented(result)}\nstatus: {ENDINGS.get(status, str(status))}")
        return 0 if status == STATUS_SUCCEEDED else 1

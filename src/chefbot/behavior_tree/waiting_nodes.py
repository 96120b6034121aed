"""Leaves that wait for a blocked path."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

from py_trees.common import Status

from chefbot.behavior_tree.blackboard import NodePort, NodePorts
from chefbot.behavior_tree.catalog import Catalog, NodeKind, NodeType
from chefbot.behavior_tree.leaves import ActionLeaf, ConditionLeaf, Pending
from chefbot.behavior_tree.navigation_nodes import ERROR_PORTS, GoalAction, NavigationServices, ServiceAction
from chefbot.msgs.chefbot_msgs import FindBlockage_Result


class WaitingServices(NavigationServices, Protocol):
    """What the leaves of a tree that waits need in addition."""

    def find_blocked_path(self, goal: object, error_code: int, find_waiting_pose: bool) -> Pending | None:
        """Find what the robot should wait for on its way to a pose, after an error or 0 for none, and where.

        The result is a `FindBlockage_Result`, or None if it should not wait. None: nothing can be in the way.
        """

    def wait_for_path(self, goal: object, error_code: int) -> Pending:
        """Wait until the path is free or another one is quicker; the result is a `CodedResult`."""

    def is_at(self, pose: object) -> bool:
        """Return whether the robot is at a pose."""

    def is_goal_occupied(self) -> bool:
        """Return whether the newest path ends beside its occupied goal."""

    def face_obstacle(self, goal: object) -> Pending:
        """Rotate in place until the robot faces what occupies a pose; the result is a `CodedResult`."""


class IsPathBlocked(ActionLeaf):
    """Succeeds if people or other things that may go away block the path to `goal` and waiting is what to do.

    It compares the expected times of waiting and of the other path. `error_code`: of the failed action, 0 for none.
    """

    def __init__(self, services: WaitingServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._services = services

    def begin(self) -> Pending | None:
        """Find what blocks the path."""
        code = int(self.ports.number("error_code"))
        goal, where = self.ports.value("goal"), "waiting_pose" in self.ports.given
        return self._services.find_blocked_path(goal, code, where)

    def finish(self, result: object) -> Status:
        """Write the waiting pose if the path is blocked, else fail."""
        if not isinstance(result, FindBlockage_Result):
            return Status.FAILURE
        self.ports.write("waiting_pose", result.waiting_pose)
        return Status.SUCCESS


class WaitForPath(GoalAction):
    """Waits until the path to `goal` is free or another one is quicker; requests to pass, and fails after a time."""

    services: WaitingServices

    def begin(self) -> Pending:
        """Start to wait for the path to `goal`."""
        return self.services.wait_for_path(self.ports.value("goal"), int(self.ports.number("error_code")))


class GoalReached(ConditionLeaf):
    """Holds if the robot is at `goal`."""

    def __init__(self, services: WaitingServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._services = services

    def holds(self) -> bool:
        """Return whether it is there."""
        return self._services.is_at(self.ports.value("goal"))


class IsGoalOccupied(ConditionLeaf):
    """Holds if the newest path ends beside its goal because that is occupied."""

    def __init__(self, services: WaitingServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._services = services

    def holds(self) -> bool:
        """Return whether the goal is occupied."""
        return self._services.is_goal_occupied()


class FaceObstacle(ServiceAction):
    """Rotates in place until the robot faces what occupies `goal`, so that its sensors look there."""

    services: WaitingServices

    def begin(self) -> Pending:
        """Start to rotate towards what occupies `goal`."""
        return self.services.face_obstacle(self.ports.value("goal"))


def waiting_nodes(services: WaitingServices) -> Catalog:
    """Return the types of leaves that wait by these services."""
    goal, error = NodePort("goal", object), NodePort("error_code", int, default="0")

    def action(make: Callable[..., ActionLeaf], *ports: NodePort) -> NodeType:
        return NodeType(NodeKind.ACTION, partial(make, services), (goal, error, *ports))

    return {
        "IsPathBlocked": action(IsPathBlocked, NodePort("waiting_pose", object, "output", "")),
        "WaitForPath": action(WaitForPath, *ERROR_PORTS),
        "GoalReached": NodeType(NodeKind.CONDITION, partial(GoalReached, services), (goal,)),
        "IsGoalOccupied": NodeType(NodeKind.CONDITION, partial(IsGoalOccupied, services)),
        "FaceObstacle": NodeType(NodeKind.ACTION, partial(FaceObstacle, services), (goal, *ERROR_PORTS)),
    }

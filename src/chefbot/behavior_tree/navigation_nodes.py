"""Leaves that navigate, with the names and ports of nav2_behavior_tree, and a few more.

What they do is behind `NavigationServices`. Ports that select a plugin or a server are read and not used: the robot
has one planner, one controller and one behavior server.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

from py_trees.common import Status

from chefbot.behavior_tree.blackboard import NodePort, NodePorts
from chefbot.behavior_tree.catalog import Catalog, NodeKind, NodeType
from chefbot.behavior_tree.leaves import ActionLeaf, ConditionLeaf, Leaf, Pending
from chefbot.msgs.nav2_msgs import ComputePathToPose_Result


class CodedResult(Protocol):
    """The result of one of Nav2's actions: an error code, 0 on success, and a description."""

    error_code: int
    error_msg: str


class NavigationServices(Protocol):
    """What the leaves of a navigation tree need. Distances are in m, angles in rad, times in s."""

    def is_localized(self) -> bool:
        """Return whether localization is not lost."""

    def is_recoverable(self, error_code: int) -> bool:
        """Return whether a recovery behavior may help against an error."""

    def note_failure(self, error_code: int, error_msg: str) -> None:
        """Note why the goal was not reached this time."""

    def relocalize(self) -> Pending:
        """Rotate in place until localization has converged; the result is a `CodedResult`."""

    def compute_path(self, goal: object, start: object) -> Pending:
        """Plan a path from a pose, None for the robot's, to another; the result is a `ComputePathToPose_Result`."""

    def follow_path(self, path: object) -> Pending:
        """Follow a path in place of the previous one; the result is a `CodedResult`."""

    def spin(self, angle: float, time_allowance: float) -> Pending:
        """Rotate in place; the result is a `CodedResult`."""

    def back_up(self, distance: float, speed: float, time_allowance: float) -> Pending:
        """Back up; the result is a `CodedResult`."""

    def back_up_to_see(self) -> Pending:
        """Back up until the robot sees what its collision monitor remembers; the result is a `CodedResult`."""

    def wait(self, seconds: float) -> Pending:
        """Stand still for a time; the result has no error code."""

    def clear_costmaps(self, radius: float) -> Pending:
        """Clear obstacles within a radius in all costmaps; done once the sensors have marked what is there."""


ENTIRE_COSTMAP = 1000.0
"""Radius that covers every costmap, m."""
TIME_ALLOWANCE = NodePort("time_allowance", float, default="10.0", minimum=0.0)
ERROR_PORTS = (
    NodePort("error_code_id", int, "output", ""),
    NodePort("error_msg", str, "output", ""),
)
PLUGINS = {
    "Planner": "planner",
    "Controller": "controller",
    "GoalChecker": "goal_checker",
    "ProgressChecker": "progress_checker",
    "Smoother": "smoother",
}
"""Names of Nav2's kinds of plugins in the nodes that select one, and in their ports."""
COMPUTE_PATH_PORTS = (
    NodePort("goal", object),
    NodePort("start", object, default=""),
    NodePort("planner_id", str, default=""),
    NodePort("path", object, "output", ""),
)
FOLLOW_PATH_PORTS = (
    NodePort("path", object),
    NodePort("controller_id", str, default=""),
    NodePort("goal_checker_id", str, default=""),
    NodePort("progress_checker_id", str, default=""),
)
SERVER_PORTS = (NodePort("server_name", str, default=""), NodePort("server_timeout", float, default="10"))


class ServiceAction(ActionLeaf):
    """Base class of an action that ends with an error code and a description."""

    def __init__(self, services: NavigationServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self.services = services

    def finish(self, result: object) -> Status:
        """Write the error and return whether there is none."""
        code, text = int(getattr(result, "error_code", 0)), str(getattr(result, "error_msg", ""))
        self.ports.write("error_code_id", code)
        self.ports.write("error_msg", text)
        self.feedback_message = text
        return Status.FAILURE if code else Status.SUCCESS


class GoalAction(ServiceAction):
    """Base class of an action without which the goal is not reached."""

    def finish(self, result: object) -> Status:
        """Write the error, and note it."""
        status = super().finish(result)
        if status is Status.FAILURE:
            self.services.note_failure(int(getattr(result, "error_code", 0)), self.feedback_message)
        return status


class ComputePathToPose(GoalAction):
    """Plans a path to `goal` from `start`, without it from the robot's pose, and writes it to `path`."""

    def begin(self) -> Pending:
        """Request a path to `goal` from the planner."""
        start = self.ports.value("start") if "start" in self.ports.given else None
        return self.services.compute_path(self.ports.value("goal"), start)

    def finish(self, result: object) -> Status:
        """Write the path, unless there is none."""
        status = super().finish(result)
        if status is Status.SUCCESS and isinstance(result, ComputePathToPose_Result):
            self.ports.write("path", result.path)
        return status


class FollowPath(GoalAction):
    """Follows `path`; when that changes, the controller switches to the new one without stopping."""

    _path: object = None

    def begin(self) -> Pending:
        """Send the path to the controller."""
        self._path = self.ports.value("path")
        return self.services.follow_path(self._path)

    def update(self) -> Status:
        """Return RUNNING until the controller is done, with the newest path."""
        running = self.pending is not None and not self.pending.done
        if running and self.ports.value("path") is not self._path:
            self.pending = self.begin()
        return super().update()


class SpinLeaf(ServiceAction):
    """Rotates in place by `spin_dist`."""

    def begin(self) -> Pending:
        """Send `spin_dist` (rad) to the behavior server."""
        return self.services.spin(self.ports.number("spin_dist"), self.ports.number("time_allowance"))


class BackUp(ServiceAction):
    """Backs up by `backup_dist` (m) at `backup_speed` (m/s)."""

    def begin(self) -> Pending:
        """Send distance, speed and time allowance to the behavior server."""
        numbers = (self.ports.number(one) for one in ("backup_dist", "backup_speed", "time_allowance"))
        return self.services.back_up(*numbers)


class BackUpToSee(ServiceAction):
    """Backs up along its own track until the depth camera sees what stops the robot, touches it or blinds the camera.

    Fails at once if there is nothing of that kind.
    """

    def begin(self) -> Pending:
        """Start to back up along the robot's track."""
        return self.services.back_up_to_see()


class Wait(ServiceAction):
    """Stands still for `wait_duration` seconds."""

    def begin(self) -> Pending:
        """Start a wait of `wait_duration` seconds."""
        return self.services.wait(self.ports.number("wait_duration"))


class ClearCostmapAroundRobot(ServiceAction):
    """Clears the costmaps within `reset_distance` of the robot."""

    def begin(self) -> Pending:
        """Request clearing within `reset_distance` (m) of the robot."""
        return self.services.clear_costmaps(self.ports.number("reset_distance"))


class ClearEntireCostmap(ServiceAction):
    """Clears all marked obstacles from the costmaps."""

    def begin(self) -> Pending:
        """Request that the costmaps are cleared entirely."""
        return self.services.clear_costmaps(ENTIRE_COSTMAP)


class Relocalize(GoalAction):
    """Rotates in place until localization has converged."""

    def begin(self) -> Pending:
        """Start rotating in place for relocalization."""
        return self.services.relocalize()


class IsLocalized(ConditionLeaf):
    """Holds unless localization is lost."""

    def __init__(self, services: NavigationServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._services = services

    def holds(self) -> bool:
        """Return whether the robot is localized."""
        return self._services.is_localized()


class WouldARecoveryHelp(ConditionLeaf):
    """Holds if a recovery behavior may help against `error_code`; not for 0, no error."""

    def __init__(self, services: NavigationServices, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._services = services

    def holds(self) -> bool:
        """Return whether a recovery may help."""
        code = int(self.ports.number("error_code"))
        return code != 0 and self._services.is_recoverable(code)


class GoalUpdated(ConditionLeaf):
    """Holds once after the blackboard's goal has changed."""

    _goal: object = None

    def holds(self) -> bool:
        """Return whether the goal differs from that of the previous tick."""
        goal = self.ports.blackboard.find("goal")
        before, self._goal = self._goal, goal
        return before is not None and goal is not before


class TimeExpired(ConditionLeaf):
    """Holds each time `seconds` have passed since its first tick, or since it last held."""

    _since_ns: int | None = None

    def holds(self) -> bool:
        """Return whether the time has passed."""
        now_ns = self.ports.blackboard.now_ns
        if self._since_ns is None:
            self._since_ns = now_ns
        if now_ns - self._since_ns < 1e9 * self.ports.number("seconds"):
            return False
        self._since_ns = now_ns
        return True


class PluginSelector(Leaf):
    """Writes the default of a selector: there is nothing else to select."""

    def __init__(self, plugin: str, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._plugin = plugin

    def update(self) -> Status:
        """Write the name of the default plugin to the output port."""
        self.ports.write(f"selected_{self._plugin}", self.ports.text(f"default_{self._plugin}"))
        return Status.SUCCESS


def navigation_nodes(services: NavigationServices) -> Catalog:
    """Return the types of leaves that navigate by these services."""
    return {
        **_path_nodes(services),
        **_recovery_nodes(services),
        **_conditions(services),
        **{f"{title}Selector": _selector(plugin) for title, plugin in PLUGINS.items()},
    }


def _action(make: type[ServiceAction], services: NavigationServices, *ports: NodePort) -> NodeType:
    return NodeType(NodeKind.ACTION, partial(make, services), (*ports, *SERVER_PORTS, *ERROR_PORTS))


def _path_nodes(services: NavigationServices) -> Catalog:
    return {
        "ComputePathToPose": _action(ComputePathToPose, services, *COMPUTE_PATH_PORTS),
        "FollowPath": _action(FollowPath, services, *FOLLOW_PATH_PORTS),
        "Relocalize": _action(Relocalize, services),
    }


def _recovery_nodes(services: NavigationServices) -> Catalog:
    service_name = NodePort("service_name", str, default="")
    duration = NodePort("wait_duration", float, default="1.0", minimum=0.0)
    radius = NodePort("reset_distance", float, default="1.0", minimum=0.0)
    return {
        "Spin": _action(SpinLeaf, services, NodePort("spin_dist", float, default="1.57"), TIME_ALLOWANCE),
        "BackUp": _action(
            BackUp,
            services,
            TIME_ALLOWANCE,
            NodePort("backup_dist", float, default="0.15", minimum=0.0),
            NodePort("backup_speed", float, default="0.025", minimum=0.0),
        ),
        "BackUpToSee": _action(BackUpToSee, services),
        "Wait": _action(Wait, services, duration),
        "ClearCostmapAroundRobot": _action(ClearCostmapAroundRobot, services, service_name, radius),
        "ClearEntireCostmap": _action(ClearEntireCostmap, services, service_name),
    }


def _conditions(services: NavigationServices) -> Catalog:
    seconds, error = NodePort("seconds", float, default="1.0"), NodePort("error_code", int, default="0")
    recovery_helps = NodeType(NodeKind.CONDITION, partial(WouldARecoveryHelp, services), (error,))
    return {
        "IsLocalized": NodeType(NodeKind.CONDITION, partial(IsLocalized, services)),
        "WouldAPlannerRecoveryHelp": recovery_helps,
        "WouldAControllerRecoveryHelp": recovery_helps,
        "GoalUpdated": NodeType(NodeKind.CONDITION, GoalUpdated),
        "TimeExpired": NodeType(NodeKind.CONDITION, TimeExpired, (seconds,)),
    }


def _selector(plugin: str) -> NodeType:
    ports = (
        NodePort(f"selected_{plugin}", str, "output", ""),
        NodePort(f"default_{plugin}", str, default=""),
        NodePort("topic_name", str, default=""),
    )
    return NodeType(NodeKind.ACTION, partial(PluginSelector, plugin), ports)

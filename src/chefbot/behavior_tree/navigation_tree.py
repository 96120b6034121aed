"""The navigator's behavior trees: the built-in ones, or that of a file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from chefbot.behavior.recovery import BACK_UP_SPEED_FRACTION, NavigatorParams
from chefbot.behavior_tree.blackboard import BehaviorTreeError
from chefbot.behavior_tree.bt_xml import TreeFile, build_tree, read_tree_file
from chefbot.behavior_tree.catalog import CONTROL_NODES, Catalog
from chefbot.behavior_tree.navigation_nodes import navigation_nodes
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.behavior_tree.waiting_nodes import WaitingServices, waiting_nodes
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.robot.motion_limits import max_speed
from chefbot.robot.spec import Robot

BUILT_IN = "navigate_to_pose.xml"
LOOKING_AHEAD = "NavigateToPoseLookingAhead"
"""Tree of the built-in file for a robot whose sensors look ahead only."""
MAX_BYTES = 1_000_000


def built_in_trees(*, forward_sensing_only: bool) -> TreeFile:
    """Return the built-in file, with the tree to run for a robot with such sensors."""
    data = resources.files("chefbot.behavior_tree").joinpath("trees", BUILT_IN).read_bytes()
    file = read_tree_file(data, BUILT_IN)
    return file._replace(main=LOOKING_AHEAD) if forward_sensing_only else file


def load_trees(path: Path) -> TreeFile:
    """Return the trees of a file; BehaviorTreeError if it cannot be read or is none."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise BehaviorTreeError(f"{path}: has more than {MAX_BYTES} bytes, too many for a behavior tree")
        return read_tree_file(path.read_bytes(), str(path))
    except OSError as error:
        raise BehaviorTreeError(f"{path}: cannot be read: {error.strerror}") from None


class NavigationTrees:
    """Makes a tree for each goal.

    path: file of the tree; empty for the built-in one. BehaviorTreeError if the file has no tree that can run.
    """

    def __init__(self, services: WaitingServices, robot: Robot, path: str) -> None:
        self._catalog: Catalog = {
            **CONTROL_NODES,
            **navigation_nodes(services),
            **waiting_nodes(services),
        }
        self._back_up_speed = BACK_UP_SPEED_FRACTION * max_speed(robot)
        forward_only = not robot.sensors.covers_rear
        self._file = load_trees(Path(path)) if path else built_in_trees(forward_sensing_only=forward_only)
        tree = build_tree(self._file, self._catalog)
        self._recoveries = max(
            (len(node.children) for node in tree.root.iterate() if tree.type_of(node) == "RoundRobin"),
            default=1,
        )

    def new_tree(self, goal: PoseStamped) -> BehaviorTree:
        """Return a tree that navigates to a goal."""
        tree = build_tree(self._file, self._catalog)
        tree.blackboard.set("goal", goal)
        tree.blackboard.set("error_code", 0)
        return tree

    def set_params(self, tree: BehaviorTree, params: NavigatorParams) -> None:
        """Write the parameters to the tree's blackboard."""
        recovery = params.recovery
        values = {
            "replan_rate": 1.0 / params.replan_period,
            "number_of_retries": recovery.rounds * self._recoveries,
            "clear_radius": recovery.clear_radius,
            "backup_dist": recovery.back_up,
            "backup_speed": self._back_up_speed,
            "spin_dist": recovery.spin,
            "wait_duration": recovery.wait,
            "goal_attempts": round(params.waiting.at_goal),
        }
        for key, value in values.items():
            tree.blackboard.set(key, value)

"""nav2_msgs: particle clouds and navigation actions as in Kilted; for other distributions see `editions`.

FollowObject is that of Lyrical, as Kilted has none.
"""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Any

from chefbot.msgs.builtin_interfaces import Duration, Time
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.idl.action import define_action
from chefbot.msgs.idl.constraints import MAX_MAGNITUDE, per_field
from chefbot.msgs.idl.message import Bool, Float32, Float64, Int16, Message, String, Uint8, Uint16, Uint32
from chefbot.msgs.nav_msgs import Goals, Path
from chefbot.msgs.std_msgs import Empty, Header

MAX_SPIN = 1000.0
"""Largest rotation in place, rad."""
MAX_PARTICLES = 100_000
MAX_TREE_NODES = 10_000
MAX_WAYPOINTS = 1000
PENDING, COMPLETED, SKIPPED, FAILED = range(4)
"""Values of the field `waypoint_status` of WaypointStatus."""
INITIAL_PERCEPTION, CONTROLLING, STOPPING, RETRY = range(1, 5)
"""Values of the field `state` of FollowObject_Feedback."""
_SPEED = {"speed": (-MAX_MAGNITUDE, MAX_MAGNITUDE)}


class Particle(Message, frozen=True, eq=False):
    """A pose hypothesis of the particle filter with its weight."""

    pose: Pose = Pose()
    weight: Float64 = 0.0


class ParticleCloud(Message, frozen=True, eq=False):
    """All particles of the particle filter."""

    MAX_LENGTHS = per_field(particles=MAX_PARTICLES)

    header: Header = Header()
    particles: tuple[Particle, ...] = ()


class BehaviorTreeStatusChange(Message, frozen=True, eq=False):
    """A change of the status of one node of a behavior tree: IDLE, RUNNING, SUCCESS or FAILURE."""

    timestamp: Time = Time()
    node_name: String = ""
    uid: Uint16 = 0
    """Number of the node in the tree, parents before their children, from 1 on."""
    previous_status: String = ""
    current_status: String = ""


class BehaviorTreeLog(Message, frozen=True, eq=False):
    """The changes of a behavior tree in one tick."""

    MAX_LENGTHS = per_field(event_log=MAX_TREE_NODES)

    timestamp: Time = Time()
    event_log: tuple[BehaviorTreeStatusChange, ...] = ()


class SpeedLimit(Message, frozen=True, eq=False):
    """The maximum speed, m/s, or with `percentage` in percent of the robot's; 0 for no limit."""

    BOUNDS = per_field(speed_limit=(0.0, MAX_MAGNITUDE))

    header: Header = Header()
    percentage: Bool = False
    speed_limit: Float64 = 0.0


class CostmapFilterInfo(Message, frozen=True, eq=False):
    """What a filter mask means: the value of a cell is base + multiplier times its occupancy.

    `type`: 0 keep-out and preferred areas, 1 speed in percent, 2 speed in m/s.
    """

    header: Header = Header()
    type: Uint8 = 0
    filter_mask_topic: String = ""
    base: Float32 = 0.0
    multiplier: Float32 = 0.0


class NavigateToPose_Goal(Message, frozen=True, eq=False):
    """Navigate to a pose, with an optional behavior tree."""

    pose: PoseStamped = PoseStamped()
    behavior_tree: String = ""


class NavigateToPose_Result(Message, frozen=True, eq=False):
    """The error code of the navigation, 0 on success, and a description."""

    error_code: Uint16 = 0
    error_msg: String = ""


class NavigateToPose_Feedback(Message, frozen=True, eq=False):
    """Pose, times, number of recoveries and remaining distance of the navigation."""

    current_pose: PoseStamped = PoseStamped()
    navigation_time: Duration = Duration()
    estimated_time_remaining: Duration = Duration()
    number_of_recoveries: Int16 = 0
    distance_remaining: Float32 = 0.0


class WaypointStatus(Message, frozen=True, eq=False):
    """Whether a waypoint was reached, and why not: PENDING, COMPLETED, SKIPPED or FAILED."""

    waypoint_status: Uint8 = 0
    waypoint_index: Uint32 = 0
    waypoint_pose: PoseStamped = PoseStamped()
    error_code: Uint16 = 0
    error_msg: String = ""


class MissedWaypoint(Message, frozen=True, eq=False):
    """A waypoint that was not reached, as Jazzy reports it; newer distributions have WaypointStatus."""

    index: Uint32 = 0
    goal: PoseStamped = PoseStamped()
    error_code: Uint16 = 0


def _few_poses(message: Any) -> str:
    """Limit the poses, of which each feedback states the status."""
    n = len(message.poses.goals)
    return f"poses has {n} elements, at most {MAX_WAYPOINTS} can be used" if n > MAX_WAYPOINTS else ""


class NavigateThroughPoses_Goal(Message, frozen=True, eq=False):
    """Navigate through poses without stopping at those before the last one, with an optional behavior tree."""

    RULES = (_few_poses,)

    poses: Goals = Goals()
    behavior_tree: String = ""


class NavigateThroughPoses_Result(Message, frozen=True, eq=False):
    """The error code of the navigation, 0 on success, a description, and which poses were passed."""

    MAX_LENGTHS = per_field(waypoint_statuses=MAX_WAYPOINTS)

    error_code: Uint16 = 0
    error_msg: String = ""
    waypoint_statuses: tuple[WaypointStatus, ...] = ()


class NavigateThroughPoses_Feedback(Message, frozen=True, eq=False):
    """Feedback as of NavigateToPose, with the number of poses that remain."""

    MAX_LENGTHS = per_field(waypoint_statuses=MAX_WAYPOINTS)

    current_pose: PoseStamped = PoseStamped()
    navigation_time: Duration = Duration()
    estimated_time_remaining: Duration = Duration()
    number_of_recoveries: Int16 = 0
    distance_remaining: Float32 = 0.0
    number_of_poses_remaining: Int16 = 0
    waypoint_statuses: tuple[WaypointStatus, ...] = ()


class FollowWaypoints_Goal(Message, frozen=True, eq=False):
    """Navigate to each waypoint in order, from `goal_index` on, and then `number_of_loops` times again."""

    MAX_LENGTHS = per_field(poses=MAX_WAYPOINTS)

    number_of_loops: Uint32 = 0
    goal_index: Uint32 = 0
    poses: tuple[PoseStamped, ...] = ()


class FollowWaypoints_Result(Message, frozen=True, eq=False):
    """The waypoints that were not reached, and an error code, 0 on success, with a description."""

    MAX_LENGTHS = per_field(missed_waypoints=MAX_WAYPOINTS)

    missed_waypoints: tuple[WaypointStatus, ...] = ()
    error_code: Uint16 = 0
    error_msg: String = ""


class FollowWaypoints_Feedback(Message, frozen=True, eq=False):
    """Index of the waypoint to which the robot drives."""

    current_waypoint: Uint32 = 0


class FollowObject_Goal(Message, frozen=True, eq=False):
    """Follow an object whose pose is published on a topic, or a frame; `max_duration` 0: no limit."""

    pose_topic: String = ""
    tracked_frame: String = ""
    max_duration: Duration = Duration()


class FollowObject_Result(Message, frozen=True, eq=False):
    """The elapsed time, an error code, 0 on success, how often the object was lost, and a description."""

    total_elapsed_time: Duration = Duration()
    error_code: Uint16 = 0
    num_retries: Uint16 = 0
    error_msg: String = ""


class FollowObject_Feedback(Message, frozen=True, eq=False):
    """What the robot does, the elapsed time, and how often the object was lost so far."""

    state: Uint16 = 0
    """INITIAL_PERCEPTION, CONTROLLING, STOPPING or RETRY."""
    following_time: Duration = Duration()
    num_retries: Uint16 = 0


class ComputePathToPose_Goal(Message, frozen=True, eq=False):
    """Plan a path to a pose, from `start` or from the robot's pose."""

    goal: PoseStamped = PoseStamped()
    start: PoseStamped = PoseStamped()
    planner_id: String = ""
    use_start: Bool = False


class ComputePathToPose_Result(Message, frozen=True, eq=False):
    """The planned path, or an error code that is not 0."""

    path: Path = Path()
    planning_time: Duration = Duration()
    error_code: Uint16 = 0
    error_msg: String = ""


class ComputePathToPose_Feedback(Message, frozen=True, eq=False):
    """Feedback without content; ROS requires one member."""

    structure_needs_at_least_one_member: Uint8 = 0


class FollowPath_Goal(Message, frozen=True, eq=False):
    """Follow a path with a controller."""

    path: Path = Path()
    controller_id: String = ""
    goal_checker_id: String = ""
    progress_checker_id: String = ""


class FollowPath_Result(Message, frozen=True, eq=False):
    """The error code of the controller, 0 on success; the first field is obsolete but part of the type."""

    result: Empty = Empty()
    error_code: Uint16 = 0
    error_msg: String = ""


class FollowPath_Feedback(Message, frozen=True, eq=False):
    """Remaining distance, m, and speed, m/s."""

    BOUNDS = _SPEED

    distance_to_goal: Float32 = 0.0
    speed: Float32 = 0.0


class Spin_Goal(Message, frozen=True, eq=False):
    """Rotate in place by `target_yaw`, rad."""

    BOUNDS = per_field(target_yaw=(-MAX_SPIN, MAX_SPIN))

    target_yaw: Float32 = 0.0
    time_allowance: Duration = Duration()
    disable_collision_checks: Bool = False


class Spin_Result(Message, frozen=True, eq=False):
    """The elapsed time, and an error code, 0 on success."""

    total_elapsed_time: Duration = Duration()
    error_code: Uint16 = 0
    error_msg: String = ""


class Spin_Feedback(Message, frozen=True, eq=False):
    """The angle turned so far, rad."""

    angular_distance_traveled: Float32 = 0.0


class BackUp_Goal(Message, frozen=True, eq=False):
    """Drive backwards by `target.x` metres, whatever its sign."""

    BOUNDS = _SPEED

    target: Point = Point()
    speed: Float32 = 0.0
    time_allowance: Duration = Duration()
    disable_collision_checks: Bool = False


class BackUp_Result(Message, frozen=True, eq=False):
    """The elapsed time, and an error code, 0 on success."""

    total_elapsed_time: Duration = Duration()
    error_code: Uint16 = 0
    error_msg: String = ""


class BackUp_Feedback(Message, frozen=True, eq=False):
    """The distance travelled so far, m."""

    distance_traveled: Float32 = 0.0


class DriveOnHeading_Goal(Message, frozen=True, eq=False):
    """Drive straight by `target.x` metres; `speed` has the same sign."""

    BOUNDS = _SPEED

    target: Point = Point()
    speed: Float32 = 0.0
    time_allowance: Duration = Duration()
    disable_collision_checks: Bool = False


class DriveOnHeading_Result(Message, frozen=True, eq=False):
    """The elapsed time, and an error code, 0 on success."""

    total_elapsed_time: Duration = Duration()
    error_code: Uint16 = 0
    error_msg: String = ""


class DriveOnHeading_Feedback(Message, frozen=True, eq=False):
    """The distance travelled so far, m."""

    distance_traveled: Float32 = 0.0


NavigateToPose = define_action(NavigateToPose_Goal, NavigateToPose_Result, NavigateToPose_Feedback)
NavigateThroughPoses = define_action(
    NavigateThroughPoses_Goal, NavigateThroughPoses_Result, NavigateThroughPoses_Feedback
)
FollowWaypoints = define_action(FollowWaypoints_Goal, FollowWaypoints_Result, FollowWaypoints_Feedback)
FollowObject = define_action(FollowObject_Goal, FollowObject_Result, FollowObject_Feedback)
ComputePathToPose = define_action(
    ComputePathToPose_Goal, ComputePathToPose_Result, ComputePathToPose_Feedback
)
FollowPath = define_action(FollowPath_Goal, FollowPath_Result, FollowPath_Feedback)
Spin = define_action(Spin_Goal, Spin_Result, Spin_Feedback)
BackUp = define_action(BackUp_Goal, BackUp_Result, BackUp_Feedback)
DriveOnHeading = define_action(DriveOnHeading_Goal, DriveOnHeading_Result, DriveOnHeading_Feedback)

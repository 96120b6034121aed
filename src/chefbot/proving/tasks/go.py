"""Task `go`: drive to places on the true map, in spec."""

from __future__ import annotations

from chefbot.demo.score import ARRIVAL_TOLERANCE
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.proving.record import GoalRecord
from chefbot.proving.scenario_tasks import GoTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.localize import start_localized


def go(run: SimulatedRun) -> None:
    """Localize, then drive to the drawn places."""
    assert isinstance(run.scenario.task, GoTask)
    start_localized(run, run.true_map(), unknown=False)
    # A goal at the start would be reached without driving.
    names = sorted(
        name for name, pose in run.places.items() if pose.distance(run.start) > 2 * ARRIVAL_TOLERANCE
    )
    if not names:
        raise UserError(f"world {run.world.name} has no place to drive to besides the start")
    rounds = -(-run.scenario.task.goals // len(names))
    drawn = [names[i] for _ in range(rounds) for i in run.rng.permutation(len(names))]
    missed = [name for name in drawn[: run.scenario.task.goals] if not drive_to(run, name)]
    if missed:
        raise TaskFailedError(f"not reached: {', '.join(missed)}")


def drive_to(run: SimulatedRun, name: str) -> bool:
    """Send one goal, wait until the navigator is idle again, and record it."""
    began, goal = run.time, run.places[name]
    run.publish("goal_pose", PoseStamped(Header.of(run.system.loop.now_ns, "map"), Pose.of(goal)))
    reason = ""
    try:
        run.run_until(lambda: _status(run).state != "idle", "the navigator did not start", 10.0)
        run.run_until(lambda: _status(run).state == "idle", f"{name} was not reached")
        reason = _status(run).reason
    except TaskFailedError as error:
        reason = str(error)
    distance = run.truth.distance(goal)
    reached = distance <= ARRIVAL_TOLERANCE
    run.goals.append(
        GoalRecord(
            place=name,
            began=began,
            ended=run.time,
            reached=reached,
            distance=round(distance, 3),
            reason="" if reached else reason,
        )
    )
    return reached


def _status(run: SimulatedRun) -> NavigationStatus:
    status = run.latest.get("navigation_status")
    return status if isinstance(status, NavigationStatus) else NavigationStatus(state="idle")

"""Task `localize`: find the pose on the true map of the world."""

from __future__ import annotations

from pathlib import Path

from chefbot.demo.score import simulated_click
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.proving.scenario_tasks import LocalizeTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.ui.display.message_conversion import clicked_pose

TIMEOUT = 400.0
"""Time to localize in, s."""
TOLERANCE = 0.5
"""Largest position error of a robot that is localized, m."""
SETTLE_TIME = 2.0
"""Time after the report before the error is measured, s."""


def localize(run: SimulatedRun) -> None:
    """Localize as the task requires, and compare the pose with the ground truth."""
    assert isinstance(run.scenario.task, LocalizeTask)
    start_localized(run, run.true_map(), run.scenario.task.initial_pose == "unknown")
    run.run_for(SETTLE_TIME)
    track = run.scorer.delivering
    if not track.truth:
        raise TaskFailedError("the robot never published a pose")
    error = track.truth[-1].distance(track.estimate[-1])
    if error > TOLERANCE:
        raise TaskFailedError(f"the robot claims to be localized and is {error:.2f} m off")


def start_localized(run: SimulatedRun, map_file: Path, unknown: bool) -> None:
    """Launch the waiter on a map and wait until it is localized; unknown: without an approximate pose."""
    run.scorer.phase = "localizing"
    run.launch("waiter", {"map_file": str(map_file)})
    if unknown:
        run.publish("reinitialize_global_localization", Empty())
    else:
        pose = simulated_click(run.truth, run.rng)
        stamped = PoseStamped(Header.of(run.system.loop.now_ns, "map"), Pose.of(pose))
        run.publish("initialpose", clicked_pose(stamped))
    run.run_until(lambda: "localized" in run.latest, "the robot was not localized", TIMEOUT)
    answer = run.latest["localized"]
    if not (isinstance(answer, Bool) and answer.data):
        raise TaskFailedError("the robot did not localize")
    run.scorer.phase = "delivering"

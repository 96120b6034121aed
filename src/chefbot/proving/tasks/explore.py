"""Task `explore`: map the world autonomously and return to the start."""

from __future__ import annotations

from chefbot.demo.summary import map_quality
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError


def explore(run: SimulatedRun) -> None:
    """Explore until the explorer is done, and check that the robot is back."""
    explore_world(run)
    if not run.scorer.at_home():
        raise TaskFailedError("the robot did not return to its start")


def explore_world(run: SimulatedRun) -> None:
    """Launch exploration and run until the explorer is done."""
    run.launch("explore", {})
    run.run_until(lambda: _status(run).done, "exploration was not done")


def _status(run: SimulatedRun) -> ExplorationStatus:
    status = run.latest.get("exploration_status")
    return status if isinstance(status, ExplorationStatus) else ExplorationStatus()


def map_figures(run: SimulatedRun) -> dict[str, float]:
    """Return the quality of the map made in a run; empty if there is none."""
    grid = run.scorer.saved_map or run.scorer.final_map()
    if grid is None:
        return {}
    result = map_quality(grid, run.world, run.system.robot)
    return {"explored": result.explored, "map_precision": result.precision, "map_recall": result.recall}

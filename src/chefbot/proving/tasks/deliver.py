"""Task `deliver`: fetch food in the kitchen, serve tables and return home, on the true map or an explored one."""

from __future__ import annotations

from chefbot.demo.button_presser import ButtonPresser
from chefbot.demo.score import ARRIVAL_TOLERANCE
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order
from chefbot.proving.record import GoalRecord
from chefbot.proving.scenario_tasks import DeliverTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.explore import explore_world
from chefbot.proving.tasks.localize import start_localized
from chefbot.runtime.loop import Publication


def deliver(run: SimulatedRun) -> None:
    """Localize, order food for the drawn tables, and check that each was truly reached."""
    assert isinstance(run.scenario.task, DeliverTask)
    drawn = _drawn_tables(run, run.scenario.task.tables)
    if run.scenario.task.explores:
        _localize_on_own_map(run)
    else:
        start_localized(run, run.true_map(), unknown=False)
    arrivals = _Arrivals(run)
    for observer in (ButtonPresser(run.system.loop), arrivals):
        run.system.loop.add_observer(observer)
    run.publish("order", Order(tuple(drawn)))
    try:
        run.run_until(lambda: arrivals.ended, "the deliveries were not done")
    finally:
        arrivals.add_missing(drawn)
    missed = [goal.place for goal in run.goals if not goal.reached]
    if missed:
        raise TaskFailedError(f"not served: {', '.join(missed)}; {run.scorer.delivery.description}")
    if not run.scorer.at_home():
        raise TaskFailedError("the robot did not return home")


def _localize_on_own_map(run: SimulatedRun) -> None:
    """Explore the world, then restart all nodes with only the saved map; a camera alone needs an approximate pose."""
    explore_world(run)
    start_localized(run, run.saved_map(), unknown=run.system.robot.sensors.lidar is not None)


def _drawn_tables(run: SimulatedRun, count: int) -> list[str]:
    tables = sorted(name for name in run.places if name.startswith("table_"))
    if not tables or "kitchen" not in run.places:
        raise UserError(f"world {run.world.name} has no kitchen or no table to deliver to")
    return [tables[i] for i in run.rng.permutation(len(tables))[:count]]


class _Arrivals:
    """Observes the deliveries and records where the robot truly was when it reported its arrival."""

    def __init__(self, run: SimulatedRun) -> None:
        self._run, self._began = run, run.time
        self._under_way = False
        self.ended = False

    def __call__(self, publication: Publication) -> None:
        status = publication.message
        if not isinstance(status, DeliveryStatus):
            return
        self.ended = status.state == "failed" or (self._under_way and status.state == "idle")
        self._under_way = self._under_way or status.state not in ("", "idle", "failed")
        if status.state == "waiting" and status.place not in [goal.place for goal in self._run.goals]:
            self._add(status.place, "")

    def add_missing(self, drawn: list[str]) -> None:
        """Record the tables at which the robot never reported its arrival."""
        known = [goal.place for goal in self._run.goals]
        for name in drawn:
            if name not in known:
                self._add(name, self._run.scorer.delivery.description or "never served")

    def _add(self, place: str, reason: str) -> None:
        run = self._run
        distance = run.truth.distance(run.places[place])
        reached = not reason and distance <= ARRIVAL_TOLERANCE
        goal = GoalRecord(
            place=place,
            began=self._began,
            ended=run.time,
            reached=reached,
            distance=round(distance, 3),
            reason=reason,
        )
        run.goals.append(goal)
        self._began = run.time

"""A run without a simulator: its robot does at once, or not at all, what a test requests."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from tests.support.proving_runs import tiny

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, ExplorationStatus, NavigationStatus, Order
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Bool
from chefbot.proving.record import GoalRecord
from chefbot.proving.scenario_tasks import RunLimits, Task
from chefbot.proving.simulated_run import SECOND, SimulatedRun
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import DEVICE, Loop, Publication

ROBOT = load_robot("chefbot_lidar")
TICK_NS = SECOND // 10
DRIVE = 10.0
"""Time that the robot takes to a goal, s."""


class FakeRun(SimulatedRun):
    """A run whose robot reaches each goal after DRIVE seconds, but for the places in `missed`.

    missed: reason of the navigator for each place that is not reached; None: it never sets out.
    """

    def __init__(
        self,
        task: Task,
        places: Mapping[str, SE2] | None = None,
        limit: float = 300.0,
        missed: Mapping[str, str | None] | None = None,
        seed: int = 1,
    ) -> None:
        loop = Loop(StepClock())
        self.system: Any = SimpleNamespace(loop=loop, robot=ROBOT)
        self.scenario, self.seed, self.folder = tiny(task=task, limits=RunLimits(time=limit)), seed, Path()
        self.world: Any = SimpleNamespace(name="fake", doors=(), start=IDENTITY)
        self.places, self.start = dict(places or {}), IDENTITY
        self.rng = np.random.default_rng(seed)
        self.goals: list[GoalRecord] = []
        self.figures: dict[str, float] = {}
        self.latest: dict[str, Message] = {}
        self.fault = ""
        self.scorer: Any = SimpleNamespace(
            last_ground_truth=IDENTITY,
            delivery=DeliveryStatus(),
            at_home=lambda: True,
            phase="",
            saved_map=None,
            final_map=lambda: None,
        )
        self.safety: Any = SimpleNamespace(
            simulation=SimpleNamespace(truth=lambda: SimpleNamespace(pose=self.truth)),
            clearance=lambda _: 9.0,
        )
        self.missed = dict(missed or {})
        self.launched: list[str] = []
        self.maps: list[str] = []
        """The maps that the robot is started on."""
        self.sent: list[Publication] = []
        """What the task has published, as a person would."""
        loop.add_observer(self._keep)
        loop.add_observer(self._note)
        for topic, handler in (
            ("goal_pose", self._on_goal),
            ("initialpose", self._on_pose),
            ("reinitialize_global_localization", self._on_pose),
            ("order", self._on_order),
        ):
            loop.subscribe(topic, "fake", handler)
        self.later(0.1, self._tick)

    def later(self, seconds: float, action: Any) -> None:
        """Do something after some seconds."""
        self.system.loop.schedule(self.system.loop.now_ns + round(seconds * SECOND), DEVICE, action)

    def publish_as_robot(self, topic: str, message: Message) -> None:
        """Publish as a node of the robot."""
        if isinstance(message, DeliveryStatus):
            self.scorer.delivery = message
        self.system.loop.publish(topic, message, "robot")

    def launch(self, name: str, arguments: dict[str, str]) -> None:
        """Note what is launched; exploration is done after DRIVE seconds."""
        self.launched.append(name)
        self.maps += [arguments["map_file"]] if "map_file" in arguments else []
        if name == "explore":
            self.later(
                DRIVE, lambda: self.publish_as_robot("exploration_status", ExplorationStatus(done=True))
            )

    def true_map(self) -> Path:
        """Return the path of no map."""
        return Path("true_map.yaml")

    def saved_map(self) -> Path:
        """Return the path of no map."""
        return Path("explored_map.yaml")

    def _tick(self) -> None:
        self.later(0.1, self._tick)

    def _note(self, publication: Publication) -> None:
        if publication.publisher == "person":
            self.sent.append(publication)

    def _on_pose(self, _: Message) -> None:
        self.later(1.0, lambda: self.publish_as_robot("localized", Bool(True)))

    def _name(self, pose: SE2) -> str:
        return min(self.places, key=lambda name: self.places[name].distance(pose))

    def _on_goal(self, message: Message) -> None:
        assert isinstance(message, PoseStamped)
        name = self._name(message.pose.se2)
        reason = self.missed.get(name, "")
        if reason is not None:
            self.later(
                0.5, lambda: self.publish_as_robot("navigation_status", NavigationStatus(state="driving"))
            )
            self.later(DRIVE, lambda: self._arrive(name, reason))

    def _arrive(self, name: str, reason: str) -> None:
        if not reason:
            self.scorer.last_ground_truth = self.places[name]
        self.publish_as_robot("navigation_status", NavigationStatus(state="idle", reason=reason))

    def _on_order(self, message: Message) -> None:
        assert isinstance(message, Order)
        states = [
            ("loading", "kitchen"),
            *(("waiting", place) for place in message.places),
            ("returning", "home"),
        ]
        for k, (state, place) in enumerate(states):
            reason = self.missed.get(place, "")
            if reason is not None:
                self.later(DRIVE * (k + 1), lambda state=state, place=place: self._serve(state, place))
        self.later(
            DRIVE * (len(states) + 1),
            lambda: self.publish_as_robot("delivery_status", DeliveryStatus(state="idle")),
        )

    def _serve(self, state: str, place: str) -> None:
        if place in self.places and not self.missed.get(place):
            self.scorer.last_ground_truth = self.places[place]
        for repeated in range(2):
            self.publish_as_robot(
                "delivery_status", DeliveryStatus(state=state, place=place, description=f"{repeated}")
            )

"""A run of a scenario in the simulator: launches, commands from outside, and what is observed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from chefbot.demo.score import Scorer
from chefbot.demo.summary import mapping_sensor_height
from chefbot.errors import ChefbotError
from chefbot.launcher.session import start
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.idl.message import Message
from chefbot.proving.observers import MessageHash, OdometryDrift, SafetyObserver, WrongClaims
from chefbot.proving.record import GoalRecord
from chefbot.proving.scenario import Scenario
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.runtime.callback_faults import first_fault_sentence
from chefbot.runtime.launch import Launch, NodeEntry, load_launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.faults.node_faults import inject
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.world import World
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

SECOND = 1_000_000_000
"""One second in nanoseconds."""


class TaskFailedError(ChefbotError):
    """A task that was not done, with the reason."""


class Site(NamedTuple):
    """A world with its name or file, and the pose in it where the frame `map` of the run begins."""

    world: World
    name: str
    map_frame: SE2


class SimulatedRun:
    """A scenario in progress: its system, world, observers, and what the tasks add to the record."""

    def __init__(
        self, system: NodeContainer, scenario: Scenario, seed: int, site: Site, folder: Path
    ) -> None:
        self.system, self.scenario, self.seed, self.folder = system, scenario, seed, folder
        self.world, self._site = site.world, site
        self.places = {name: site.map_frame.between(pose) for name, pose in site.world.places.items()}
        self.start = site.map_frame.between(site.world.start)
        self.rng = np.random.default_rng([seed, 0x7A5C])
        self.goals: list[GoalRecord] = []
        self.figures: dict[str, float] = {}
        """Figures that only the task of the run measures."""
        self.fault = ""
        self.latest: dict[str, Message] = {}
        """Last message of each topic."""
        self.scorer = Scorer(system, self.places)
        self.scorer.last_ground_truth = self.start
        heights = ground_clearance(system.robot), overall_height(system.robot)
        self.safety = SafetyObserver(floor_plan(site.world, *heights), system.robot.circumscribed_radius)
        self.wrong_claims, self.drift = WrongClaims(self.scorer), OdometryDrift()
        self.messages = MessageHash()
        for observer in (
            self.scorer,
            self.safety,
            self.wrong_claims,
            self.drift,
            self.messages,
            self._keep,
        ):
            system.loop.add_observer(observer)

    @property
    def time(self) -> float:
        """Simulated time since the run began, s."""
        return self.system.loop.now_ns / 1e9

    @property
    def truth(self) -> SE2:
        """Ground-truth pose of the robot in the map frame, which begins at its start."""
        return self.scorer.last_ground_truth

    def launch(self, name: str, arguments: dict[str, str]) -> None:
        """Start a launch in the scenario's world with its simulator."""
        scenario = self.scenario
        given = {**self._launch_arguments(), **arguments}
        accepted = load_launch(name).args
        launch = load_launch(name, {key: value for key, value in given.items() if key in accepted})
        params: dict[str, Any] = {
            "people": msgspec.to_builtins(scenario.people),
            "odometry_error": scenario.odometry_error,
        }
        if self._site.map_frame == IDENTITY:
            params["map_frame"] = "world"
        start(self.system, inject(with_simulator_params(launch, params), scenario.faults))
        simulator: Any = self.system.nodes["simulator"]
        self.safety.simulation = simulator.simulation

    def _launch_arguments(self) -> dict[str, str]:
        return {
            "world": self._site.name,
            "start": str(list(self._site.world.start)),
            "profile": self.scenario.profile,
            "headless": "true",
            "pictures": "0",
            "seed": str(self.seed),
            "wire": "off",
            "keep_map": "false",
        }

    def true_map(self) -> Path:
        """Write the world's true map with its places, in the world's frame, and return its path."""
        return self._written("true_map", floor_plan(self.world, mapping_sensor_height(self.system.robot)))

    def saved_map(self) -> Path:
        """Write the map that the robot has made, with the world's places, and return its path.

        Raises TaskFailedError if there is none.
        """
        grid = self.scorer.saved_map = self.scorer.final_map()
        if grid is None:
            raise TaskFailedError("exploration made no map")
        return self._written("explored_map", grid)

    def _written(self, name: str, grid: Grid) -> Path:
        path = self.folder / f"{name}.yaml"
        save_map(path, grid)
        save_places(places_path(path), self.places)
        return path

    def run_until(self, done: Callable[[], bool], what: str, limit: float | None = None) -> None:
        """Run until `done`. Raises TaskFailedError after `limit` s, or at the scenario's time limit.

        what: the state to wait for, as in '... after 300 s'.
        """
        loop = self.system.loop
        ends = (
            self.scenario.limits.time if limit is None else min(self.time + limit, self.scenario.limits.time)
        )
        loop.run(until_ns=round(ends * SECOND), until=done)
        if not done():
            raise TaskFailedError(f"{what} after {ends:.0f} s")

    def run_for(self, seconds: float) -> None:
        """Run for a time, or to the scenario's time limit."""
        ends = min(self.time + seconds, self.scenario.limits.time)
        self.system.loop.run(until_ns=round(ends * SECOND))

    def publish(self, topic: str, message: Any) -> None:
        """Publish as a person outside would, so that a replay finds the message in the log."""
        loop = self.system.loop
        loop.post(lambda: loop.publish(topic, message, "person", from_device=True))

    def _keep(self, publication: Publication) -> None:
        self.latest[publication.topic] = publication.message
        if isinstance(publication.message, DiagnosticArray):
            self.fault = first_fault_sentence(publication.message) or self.fault


def with_simulator_params(launch: Launch, params: dict[str, Any]) -> Launch:
    """Return the launch with other parameters of its simulator."""
    entry = launch.nodes["simulator"]
    changed: NodeEntry = msgspec.structs.replace(entry, params={**entry.params, **params})
    return msgspec.structs.replace(launch, nodes={**launch.nodes, "simulator": changed})

"""The phases of the demo with nodes that publish what a test needs: what ends each, and why one has failed."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chefbot.demo import demo as module
from chefbot.demo.demo import (
    ABORTED,
    DELIVERY_TIMEOUT,
    EXPLORATION_TIME_PER_AREA,
    EXPLORATION_TIMEOUT,
    LOCALIZATION_TIMEOUT,
    SECOND,
    Demo,
    DemoOptions,
)
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, ExplorationStatus, Order
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import PoseWithCovarianceStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import DEVICE, Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.world.world import load_world
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places, places_path

ROOM = load_world("room")
EXPLORED = Grid(np.zeros((20, 30), np.int8), 0.05, -0.5, -0.5)
DONE, LOCALIZED = ("exploration_status", ExplorationStatus(done=True)), ("localized", Bool(True))
MAP = ("map", OccupancyGrid.of(Header.of(0, "map"), EXPLORED))
Event = tuple[float, str, Message]


class Play(Demo):
    """A demo in which each launch begins a part of a script: seconds later, topic and message."""

    def __init__(
        self, folder: Path, robot: str = "chefbot_lidar", world: Any = ROOM, **script: list[Event]
    ) -> None:
        loop = Loop(StepClock())
        given = DemoOptions("room", robot, 7, True, "max", folder, "perfect", 0, 8080)
        kernels: Any = SimpleNamespace(busy=False)
        spec = load_robot(robot)
        super().__init__(NodeContainer(loop, spec, 7), spec, world, given, ["table_2", "table_1"], kernels)
        self.script, self.started = script, list[tuple[str, dict[str, str]]]()
        self.published = list[Publication]()
        loop.add_observer(self.published.append)
        self._tick()

    def _tick(self) -> None:
        loop = self.system.loop
        loop.schedule(loop.now_ns + SECOND // 2, DEVICE, self._tick)

    def _start(self, name: str, arguments: dict[str, str]) -> None:
        self.started.append((name, arguments))
        for seconds, topic, message in self.script.get(name, []):
            self.later(seconds, topic, message)

    def later(self, seconds: float, topic: str, message: Message) -> None:
        loop = self.system.loop
        loop.schedule(
            loop.now_ns + round(seconds * SECOND), DEVICE, lambda: loop.publish(topic, message, "robot")
        )

    def _on_publication(self, publication: Publication) -> None:
        super()._on_publication(publication)
        if publication.topic == "order":
            for seconds, topic, message in self.script.get("order", []):
                self.later(seconds, topic, message)

    @property
    def seconds(self) -> float:
        return self.system.loop.now_ns / SECOND

    def of(self, topic: str) -> list[Any]:
        return [one.message for one in self.published if one.topic == topic]


def delivered(state: str, seconds: float = 40.0, description: str = "") -> Event:
    """Return a status with the stamp of its time in a demo whose order comes 30 s after the start."""
    header = Header.of(round((30.0 + seconds) * SECOND), "map")
    return seconds, "delivery_status", DeliveryStatus(header, state, description=description)


EXPLORES: list[Event] = [(5.0, *MAP), (20.0, *DONE)]
LOCALIZES: list[Event] = [(10.0, *LOCALIZED)]


@pytest.fixture(autouse=True)
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.console, "print", lambda *_, **__: None)


def test_all_phases_follow_each_other(tmp_path: Path) -> None:
    play = Play(
        tmp_path, explore=EXPLORES, waiter=LOCALIZES, order=[delivered("driving", 5.0), delivered("idle")]
    )
    play.run()
    assert play.failure == ""
    assert [name for name, _ in play.started] == ["explore", "waiter"]
    assert play.started[1][1] == {"map_file": str(tmp_path / "map.yaml")}
    assert play.seconds == pytest.approx(70.0, abs=1.0)
    assert play.scorer.phase == "delivering" and play.wall_time > 0.0
    (order,) = play.of("order")
    assert isinstance(order, Order) and order.places == ("table_2", "table_1")
    phases = [message.data for message in play.of("phase")]
    assert [text.split()[0] for text in phases] == ["Exploring:", "Restarted;", "Delivering"]
    assert all(text.endswith(".") for text in phases)


def test_the_map_and_its_places_are_saved_before_the_restart(tmp_path: Path) -> None:
    play = Play(tmp_path, explore=EXPLORES)
    play.run()
    path = tmp_path / "map.yaml"
    assert np.array_equal(load_map(path).cells, EXPLORED.cells)
    places = load_places(places_path(path))
    start = ROOM.start
    assert set(places) == set(ROOM.places)
    assert places["kitchen"] == pytest.approx(start.between(ROOM.places["kitchen"]), abs=1e-3)


def test_exploration_without_a_map_has_failed(tmp_path: Path) -> None:
    play = Play(tmp_path, explore=[(20.0, *DONE)])
    play.run()
    assert play.failure == "exploration made no map" and len(play.started) == 1


@pytest.mark.parametrize(
    ("side", "limit"), [(10.0, EXPLORATION_TIMEOUT), (28.0, EXPLORATION_TIME_PER_AREA * 784.0)]
)
def test_exploration_has_more_time_in_a_large_building(tmp_path: Path, side: float, limit: float) -> None:
    world = dataclasses.replace(ROOM, bounds=(-5.0, 0.0, side - 5.0, side))
    play = Play(tmp_path, world=world, explore=[(5.0, *MAP)])
    play.run()
    assert play.failure == f"exploration was not done after {limit:.0f} s"
    assert play.seconds == pytest.approx(limit, abs=1.0)


@pytest.mark.parametrize(
    ("waiter", "ends"), [([], LOCALIZATION_TIMEOUT), ([(10.0, "localized", Bool(False))], 10.0)]
)
def test_a_robot_that_does_not_localize_has_failed(tmp_path: Path, waiter: list[Event], ends: float) -> None:
    play = Play(tmp_path, explore=EXPLORES, waiter=waiter)
    play.run()
    assert play.failure == "the robot did not localize on the saved map"
    assert play.seconds == pytest.approx(20.0 + ends, abs=1.0)
    assert play.of("order") == []


def test_a_lidar_localizes_globally_and_a_camera_by_a_click(tmp_path: Path) -> None:
    lidar = Play(tmp_path, explore=EXPLORES, waiter=LOCALIZES)
    lidar.run()
    assert len(lidar.of("reinitialize_global_localization")) == 1 and lidar.of("initialpose") == []
    camera = Play(tmp_path, "chefbot", explore=EXPLORES, waiter=LOCALIZES)
    camera.scorer.last_ground_truth = SE2(1.0, 2.0, 0.0)
    camera.run()
    (click,) = camera.of("initialpose")
    assert isinstance(click, PoseWithCovarianceStamped) and click.header.frame_id == "map"
    assert click.pose.pose.se2.distance(SE2(1.0, 2.0, 0.0)) == pytest.approx(0.5)
    assert camera.of("reinitialize_global_localization") == []


@pytest.mark.parametrize(
    ("order", "failure"),
    [
        ([], f"the deliveries were not done after {DELIVERY_TIMEOUT:.0f} s"),
        (
            [delivered("failed", description="the path to the kitchen is blocked")],
            "the path to the kitchen is blocked",
        ),
        ([delivered("idle", 0.5)], f"the deliveries were not done after {DELIVERY_TIMEOUT:.0f} s"),
    ],
)
def test_deliveries_end_in_a_status_after_the_order(tmp_path: Path, order: list[Event], failure: str) -> None:
    play = Play(tmp_path, explore=EXPLORES, waiter=LOCALIZES, order=order)
    play.run()
    assert play.failure == failure


def test_an_aborted_demo_ends_at_once_and_reports_it(tmp_path: Path) -> None:
    play = Play(tmp_path, explore=[(500.0, *DONE)])
    play.system.loop.schedule(9 * SECOND, DEVICE, play.abort)
    play.run()
    assert play.failure == ABORTED and not play.is_running()
    assert play.seconds == pytest.approx(9.0, abs=1.0) and len(play.started) == 1


def test_the_last_exception_of_a_node_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    faults = iter(["planner: KeyError", "", "amcl: ValueError", ""])
    monkeypatch.setattr(module, "first_fault_sentence", lambda _: next(faults))
    play = Play(
        tmp_path, explore=[(float(k), "diagnostics", DiagnosticArray()) for k in range(1, 5)] + EXPLORES
    )
    play.run()
    assert play.fault == "amcl: ValueError"


def test_operator_commands_come_from_outside_the_robot(tmp_path: Path) -> None:
    play = Play(tmp_path, explore=EXPLORES, waiter=LOCALIZES)
    play.run()
    by_person = {one.topic for one in play.published if one.publisher == "person"}
    assert {"phase", "order", "reinitialize_global_localization"} <= by_person
    assert all(one.from_device for one in play.published if one.publisher == "person")
    assert all(isinstance(message, String) for message in play.of("phase"))


# Launches


@pytest.mark.parametrize("headless", [True, False])
def test_a_launch_gets_the_options_that_it_knows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, headless: bool
) -> None:
    launches: list[Any] = []
    monkeypatch.setattr(module, "start", lambda _, launch: launches.append(launch))
    options = DemoOptions("room", "chefbot_lidar", 7, headless, "max", tmp_path, "real", 3, 8123)
    spec, kernels = load_robot("chefbot_lidar"), SimpleNamespace(busy=False)
    demo = Demo(NodeContainer(Loop(StepClock()), spec, 7), spec, ROOM, options, [], kernels)  # type: ignore[arg-type]
    demo._start("explore", {})
    demo._start("waiter", {"map_file": str(tmp_path / "map.yaml"), "nonsense": "1"})
    explore, waiter = launches
    simulator = explore.nodes["simulator"].params
    assert (simulator["world"], simulator["people"], simulator["profile"]) == ("room", 3, "real")
    assert simulator["picture_hz"] == (0 if headless else 2)
    assert any(str(tmp_path / "map.yaml") in str(entry.params) for entry in waiter.nodes.values())

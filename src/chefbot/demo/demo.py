"""`chefbot demo`: map alone, save, forget everything, localize, deliver, come home; and a report of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from chefbot.demo.processes import SPEED, Processes
from chefbot.demo.report import write_report
from chefbot.demo.score import Scorer, clicked
from chefbot.demo.summary import DemoResult, summarize
from chefbot.errors import UserError
from chefbot.kernels.precompile import Warming, start_warming
from chefbot.launcher.lan_access import EVERYWHERE, served_at
from chefbot.launcher.session import announce, session, start
from chefbot.msgs.chefbot_msgs import DeliveryStatus, ExplorationStatus, Order
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import first_fault
from chefbot.runtime.clock import LeadingClock, wall_ns
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import DEVICE, Publication
from chefbot.runtime.node_container import System
from chefbot.signals import stop_on_signals
from chefbot.sim.world.load import load_any_world, with_places
from chefbot.sim.world.world import World
from chefbot.storage.atomic_files import make_folder, write_atomic
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places
from chefbot.ui.browser import open_browser
from chefbot.ui.page import CLICK_STD_XY, CLICK_STD_YAW

SECOND = 1_000_000_000
EXPLORE_LIMIT, FIND_LIMIT, DELIVER_LIMIT = 3600.0, 400.0, 1800.0
"""Seconds of the robot's time after which a phase has failed; in a large building exploration may take longer."""
EXPLORE_RATE = 5.0
"""Seconds of exploration for each square metre of the world's bounds, of which a third is floor."""
FIRST_PICTURE = 2_500_000_000
"""Nanoseconds of the robot's time until there is a first map, before anything is planned on it."""
LOG_PERIOD = 60_000_000_000
"""Nanoseconds of the robot's time between lines of progress where the output is no terminal."""
PRESSES = {"loading": ("loaded", 3 * SECOND), "waiting": ("taken", 5 * SECOND)}
"""What the operator presses in which state, and how long after the robot's arrival (ns of its time)."""
TABLES = 3
console = Console(highlight=False)


class DemoOptions(NamedTuple):
    """As on the command line."""

    world: str
    robot: str
    seed: int
    headless: bool
    speed: str
    out: Path
    profile: str
    people: int
    port: int
    processes: bool = False
    lan: bool = False


def run_demo(options: DemoOptions) -> int:
    """Exit code: 0 if everything was delivered without a collision, else 1."""
    speed = _speed(options.speed)
    clock = LeadingClock(min(speed or SPEED, SPEED)) if options.processes else None
    robot = load_robot(options.robot)
    world = with_places(load_any_world(options.world, robot), robot, options.seed)
    tables = chosen_tables(world, options.seed)
    make_folder(options.out)
    warming = start_warming(console, None if options.headless or options.lan else options.port)
    log = options.out / "run.mcap"
    with session(robot, options.seed, "simulation", speed, log, clock) as system, ExitStack() as stack:
        demo = Demo(system, robot, world, options, tables, warming)
        if clock is not None:
            warming.wait()
            demo.processes = Processes(system, clock, console, demo.goes_on)
            stack.callback(demo.processes.close)
        with stop_on_signals(demo.give_up):
            demo.run()
    result = demo.result()
    write_atomic(options.out / "summary.json", result.to_json().encode())
    write_report(options.out, result, demo.scorer, world, robot)
    _print(result, demo.processes, options.out)
    return 0 if result.success else 1


def chosen_tables(world: World, seed: int) -> list[str]:
    """Which tables have ordered: three by chance, or as many as there are."""
    tables = sorted(name for name in world.places if name.startswith("table_"))
    if not tables or "kitchen" not in world.places:
        raise UserError(
            f"world {world.name} has no room for a kitchen and a table; the demo has nowhere to go"
        )
    if len(tables) < TABLES:
        return tables[:1]
    rng = np.random.default_rng([seed, TABLES])
    return [tables[i] for i in rng.choice(len(tables), TABLES, replace=False)]


def _speed(text: str) -> float:
    try:
        speed = 0.0 if text == "max" else float(text)
    except ValueError:
        raise UserError(f"--speed {text!r} must be 'max' or a number of times real time") from None
    if not 0.0 <= speed <= 1000.0:
        raise UserError(f"--speed {text} must lie between 0 and 1000 times real time")
    return speed


class Demo:
    """The person who runs the show: starts launches, clicks, orders; sees the truth to score and to click."""

    def __init__(
        self,
        system: System,
        robot: Robot,
        world: World,
        options: DemoOptions,
        tables: list[str],
        warming: Warming,
    ) -> None:
        self.system, self.robot, self.world, self.options, self.tables = system, robot, world, options, tables
        self.places = {name: world.start.between(pose) for name, pose in world.places.items()}
        self._warming = warming
        self.scorer = Scorer(system, self.places)
        self.map_path = options.out / "map.yaml"
        self.explored = ExplorationStatus()
        self.found: bool | None = None
        self.failure = ""
        self.fault = ""
        """What the nodes raised, of this process or of another."""
        self.processes: Processes | None = None
        """None: all in one."""
        self._given_up = False
        self._began = wall_ns()
        self._phase = ""
        self.took = 0.0
        self._rng = np.random.default_rng([options.seed, 0xC11C])
        system.loop.tap(self.scorer)
        system.loop.tap(self._watch)

    def run(self) -> None:
        """All phases; `failure` says where it ended."""
        for phase in (self._explore, self._forget_and_find, self._deliver):
            self.failure = phase()
            if self.failure and self._given_up:
                self.failure = "told to end before it was done"
            if self.failure:
                break
        self.took = (wall_ns() - self._began) / 1e9

    def goes_on(self) -> bool:
        """Until somebody gives up."""
        return not self._given_up

    def give_up(self) -> None:
        """From a signal: end after the event in hand."""
        self._given_up = True
        self.system.loop.stop()

    def result(self) -> DemoResult:
        """All figures."""
        return summarize(self)

    # -- phases

    def _explore(self) -> str:
        self._start("explore", {})
        if self.world.start_note:
            x, y, yaw = self.world.start
            console.print(
                f"The robot starts at [{x:.2f}, {y:.2f}, {yaw:.2f}], {self.world.start_note}", markup=False
            )
        self._say("Exploring: mapping the world alone")
        self._finish_warming()
        x0, y0, x1, y1 = self.world.bounds
        limit = max(EXPLORE_LIMIT, EXPLORE_RATE * (x1 - x0) * (y1 - y0))
        if not self._until(limit, lambda: self.explored.done):
            return f"exploration was not done after {limit:.0f} s"
        if self.scorer.map is None:
            return "exploration made no map"
        self.scorer.saved_map = self.scorer.map.grid
        save_map(self.map_path, self.scorer.saved_map)
        save_places(places_path(self.map_path), self.places)
        return ""

    def _forget_and_find(self) -> str:
        """A restart: every node is made anew, only the saved files are left."""
        self.scorer.phase = "localizing"
        self._start("waiter", {"map_file": str(self.map_path)})
        self._say("Everything forgotten; finding the robot on the saved map")
        self._tell_where_it_is()
        if not self._until(FIND_LIMIT, lambda: self.found is not None) or not self.found:
            return "the robot did not find itself on the saved map"
        self.scorer.phase = "delivering"
        return ""

    def _tell_where_it_is(self) -> None:
        """With a lidar it finds out by itself; for a camera a person clicks about where it stands."""
        if self.robot.sensors.lidar is not None:
            self._post("reinitialize_global_localization", Empty())
            return
        pose = clicked(self.scorer.last_truth, self._rng)
        covariance = covariance_36(np.diag([CLICK_STD_XY**2, CLICK_STD_XY**2, CLICK_STD_YAW**2]))
        header = Header.of(self.system.loop.now_ns, "map")
        click = PoseWithCovarianceStamped(header, PoseWithCovariance(Pose.of(pose), covariance))
        self._post("initialpose", click)

    def _deliver(self) -> str:
        self._say(f"Delivering to {', '.join(self.tables)}")
        self._post("order", Order(tuple(self.tables)))
        began = self.system.loop.now_ns

        def ended() -> bool:
            status = self.scorer.delivery
            return status.state in ("idle", "failed") and status.header.stamp.ns > began + SECOND

        if not self._until(DELIVER_LIMIT, ended):
            return f"the deliveries were not done after {DELIVER_LIMIT:.0f} s"
        return self.scorer.delivery.sentence if self.scorer.delivery.state == "failed" else ""

    # -- helpers

    def _start(self, name: str, arguments: dict[str, str]) -> None:
        o = self.options
        given = {
            "world": o.world,
            "profile": o.profile,
            "people": str(o.people),
            "port": str(o.port),
            "headless": str(o.headless).lower(),
            "pictures": "0" if o.headless else "2",
            "seed": str(o.seed),
            "robot": o.robot,
        }
        known = load_launch(name).args
        given = {key: value for key, value in {**given, **arguments}.items() if key in known}
        launch = load_launch(name, given)
        if o.lan:
            launch = served_at(launch, EVERYWHERE)
        if self.processes is None:
            start(self.system, launch)
        else:
            self.processes.start(launch)
        if name == "explore" and "page" in self.system.nodes:
            self._open_page()

    def _open_page(self) -> None:
        page: Any = self.system.nodes["page"]
        if not self._warming.page_opened:
            announce(console, [page])
            open_browser(page.url)

    def _finish_warming(self) -> None:
        """With a first picture on the page, wait for the kernels that thought needs."""
        if self._warming.busy:
            self.system.loop.run(until_ns=self.system.loop.now_ns + FIRST_PICTURE)
            page: Any = self.system.nodes.get("page")
            self._warming.wait(show=page.show_progress if page else lambda _: None)
            self._began = wall_ns()

    def _until(self, limit: float, done: Callable[[], bool]) -> bool:
        """Run until `done`, for `limit` seconds of the robot's time at most; shows how far it is."""
        loop = self.system.loop
        end = loop.now_ns + round(limit * SECOND)
        told_ns = loop.now_ns
        with console.status("") as status:
            while not done() and loop.now_ns < end and not self._given_up:
                loop.run(until_ns=min(end, loop.now_ns + SECOND), until=done)
                status.update(self._progress())
                if not console.is_terminal and loop.now_ns - told_ns >= LOG_PERIOD:
                    console.print(self._progress())
                    told_ns = loop.now_ns
        return done()

    def _progress(self) -> str:
        seconds, spent = self.system.loop.now_ns / 1e9, (wall_ns() - self._began) / 1e9
        pose = self.scorer.last_truth
        pace = f"{seconds:.0f} s, {seconds / spent:.1f} x real time"
        return f"{self._phase}: {pace}, at ({pose.x:.1f}, {pose.y:.1f}) m"

    def _say(self, sentence: str) -> None:
        self._phase = sentence
        console.print(f"[{self.system.loop.now_ns / 1e9:7.1f} s] {sentence}")
        self._post("phase", String(sentence + "."))

    def _post(self, topic: str, message: Any) -> None:
        """As the page would: from outside, so that a replay finds it in the log."""
        loop = self.system.loop
        loop.post(lambda: loop.publish(topic, message, "person", from_device=True))

    def _watch(self, publication: Publication) -> None:
        message = publication.message
        if isinstance(message, ExplorationStatus):
            self.explored = message
        elif publication.topic == "localized" and isinstance(message, Bool):
            self.found = message.data
        elif isinstance(message, DiagnosticArray):
            self.fault = first_fault(message) or self.fault
        elif isinstance(message, DeliveryStatus) and message.state in PRESSES:
            topic, after = PRESSES[message.state]
            loop = self.system.loop
            loop.at(loop.now_ns + after, DEVICE, lambda: self._press(topic, message.place))

    def _press(self, button: str, place: str) -> None:
        """The operator loads the food, the guest takes it: if the robot still waits for that."""
        status = self.scorer.delivery
        if status.place == place and PRESSES.get(status.state, ("", 0))[0] == button:
            self.system.loop.publish(button, Empty(), "person", from_device=True)


def _print(result: DemoResult, processes: Processes | None, out: Path) -> None:
    table = Table(box=None, show_header=False)
    for name, value in [*result.table(), *(processes.table() if processes else [])]:
        table.add_row(name, value)
    console.print(table)
    verdict = "[green]success[/]" if result.success else f"[red]failed[/]: {result.failure}"
    console.print(f"{verdict}; pictures in {out / 'report.html'}")

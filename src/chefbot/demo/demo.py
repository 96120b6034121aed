"""The operator of `chefbot demo` and its phases: map, save, restart, localize, deliver, return home."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from chefbot.demo.button_presser import ButtonPresser
from chefbot.demo.processes import DemoProcesses
from chefbot.demo.score import Scorer, simulated_click
from chefbot.exploration.session import WAITS
from chefbot.kernels.precompile import KernelCompilation
from chefbot.launcher.lan_access import ALL_ADDRESSES, with_ui_address
from chefbot.launcher.session import announce, start
from chefbot.msgs.chefbot_msgs import ExplorationStatus, Order
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import first_fault_sentence
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.world.map_world import UnknownCells
from chefbot.sim.world.world import World
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places
from chefbot.ui.browser import open_browser
from chefbot.ui.display.message_conversion import clicked_pose

SECOND = 1_000_000_000
"""One second in nanoseconds."""
EXPLORATION_TIMEOUT, LOCALIZATION_TIMEOUT, DELIVERY_TIMEOUT = 3600.0, 400.0, 1800.0
"""Time after which a phase has failed, s of the robot's time; a large building extends that of
exploration."""
EXPLORATION_TIME_PER_AREA = 5.0
"""Exploration time for each square metre of the world's bounds, of which a third is floor, s/m^2."""
FIRST_MAP_NS = 2_500_000_000
"""Time until there is a first map, before anything is planned on it, ns of the robot's time."""
LAST_MESSAGES_NS = 500_000_000
"""Time for which the nodes run on after the deliveries, so that the web UI records their end, ns."""
LOG_PERIOD = 60_000_000_000
"""Period of progress lines where the output is not a terminal, ns of the robot's time."""
ABORTED = "interrupted before it was done"
console = Console(highlight=False)


class DemoOptions(NamedTuple):
    """The options of the demo, as on the command line."""

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
    start: str = ""
    unknown: UnknownCells = "auto"
    lidar_bytes: str = ""


class Demo:
    """The operator of the demo: launches, clicks and orders.

    It uses the ground truth, to score the run and to place a click.
    """

    def __init__(
        self,
        system: NodeContainer,
        robot: Robot,
        world: World,
        options: DemoOptions,
        tables: list[str],
        warming: KernelCompilation,
    ) -> None:
        self.system, self.robot, self.world, self.options, self.tables = system, robot, world, options, tables
        self.places = {name: world.start.between(pose) for name, pose in world.places.items()}
        self._compilation = warming
        self.scorer = Scorer(system, self.places)
        self.map_path = options.out / "map.yaml"
        self.explored = ExplorationStatus()
        self.localized: bool | None = None
        self.failure = ""
        self.fault = ""
        """Last exception raised by a node, of this process or of another."""
        self.processes: DemoProcesses | None = None
        """The worker processes; None if all nodes run in this process."""
        self._aborted = False
        self._began_ns = wall_ns()
        self._phase = ""
        self.wall_time = 0.0
        self._rng = np.random.default_rng([options.seed, 0xC11C])
        system.loop.add_observer(self.scorer)
        system.loop.add_observer(ButtonPresser(system.loop))
        system.loop.add_observer(self._on_publication)

    def run(self) -> None:
        """Run all phases; `failure` is the reason why one failed."""
        for phase in (self._explore, self._localize, self._deliver):
            self.failure = phase()
            if self.failure and self._aborted:
                self.failure = ABORTED
            if self.failure:
                break
        self.wall_time = (wall_ns() - self._began_ns) / 1e9

    def is_running(self) -> bool:
        """Return whether the demo was not aborted."""
        return not self._aborted

    def abort(self) -> None:
        """Abort the demo after the current event; a signal handler."""
        self._aborted = True
        self.system.loop.stop()

    # -- phases

    def _explore(self) -> str:
        # The demo saves its map itself; the map recorder's messages depend on the disk and on the time of day
        self._start("explore", {"keep_map": "false"})
        if self.world.start_note:
            x, y, yaw = self.world.start
            console.print(
                f"The robot starts at [{x:.2f}, {y:.2f}, {yaw:.2f}], {self.world.start_note}", markup=False
            )
        self._announce_phase("Exploring: mapping the world autonomously")
        self._wait_for_kernels()
        x0, y0, x1, y1 = self.world.bounds
        limit = max(EXPLORATION_TIMEOUT, EXPLORATION_TIME_PER_AREA * (x1 - x0) * (y1 - y0))
        explored = self._run_until(limit, lambda: self.explored.done)
        self._save_map()
        if not explored:
            return f"exploration was not done after {limit:.0f} s"
        return "" if self.scorer.saved_map is not None else "exploration made no map"

    def _save_map(self) -> None:
        """Save the map made so far, if there is one, also of an exploration that was interrupted."""
        self.scorer.saved_map = self.scorer.final_map()
        if self.scorer.saved_map is not None:
            save_map(self.map_path, self.scorer.saved_map)
            save_places(places_path(self.map_path), self.places)

    def _localize(self) -> str:
        """Restart: all nodes are constructed again, only the saved files are kept."""
        self.scorer.phase = "localizing"
        self._start("waiter", {"map_file": str(self.map_path)})
        self._announce_phase("Restarted; localizing on the saved map")
        self._set_initial_pose()
        if (
            not self._run_until(LOCALIZATION_TIMEOUT, lambda: self.localized is not None)
            or not self.localized
        ):
            return "the robot did not localize on the saved map"
        self.scorer.phase = "delivering"
        return ""

    def _set_initial_pose(self) -> None:
        """Start global localization with a lidar; for a camera publish the operator's approximate click."""
        if self.robot.sensors.lidar is not None:
            self._publish_external("reinitialize_global_localization", Empty())
            return
        pose = simulated_click(self.scorer.last_ground_truth, self._rng)
        stamped = PoseStamped(Header.of(self.system.loop.now_ns, "map"), Pose.of(pose))
        self._publish_external("initialpose", clicked_pose(stamped))

    def _deliver(self) -> str:
        self._announce_phase(f"Delivering to {', '.join(self.tables)}")
        self._publish_external("order", Order(tuple(self.tables)))
        began_ns = self.system.loop.now_ns

        def ended() -> bool:
            status = self.scorer.delivery
            return status.state in ("idle", "failed") and status.header.stamp.ns > began_ns + SECOND

        if not self._run_until(DELIVERY_TIMEOUT, ended):
            return f"the deliveries were not done after {DELIVERY_TIMEOUT:.0f} s"
        self.system.loop.run(until_ns=self.system.loop.now_ns + LAST_MESSAGES_NS)
        return self.scorer.delivery.description if self.scorer.delivery.state == "failed" else ""

    # -- helpers

    def _start(self, name: str, arguments: dict[str, str]) -> None:
        options = self.options
        values = {
            "world": options.world,
            "start": options.start,
            "unknown": options.unknown,
            "profile": options.profile,
            "people": str(options.people),
            "port": str(options.port),
            "headless": str(options.headless).lower(),
            "pictures": "0" if options.headless else "2",
            "seed": str(options.seed),
            "robot": options.robot,
            "lidar_bytes": options.lidar_bytes,
        }
        accepted = load_launch(name).args
        values = {key: value for key, value in {**values, **arguments}.items() if key in accepted}
        launch = load_launch(name, values)
        if options.lan:
            launch = with_ui_address(launch, ALL_ADDRESSES)
        if self.processes is None:
            start(self.system, launch)
        else:
            self.processes.start(launch)
        if name == "explore" and "page" in self.system.nodes:
            self._open_web_ui()

    def _open_web_ui(self) -> None:
        page: Any = self.system.nodes["page"]
        if not self._compilation.page_opened:
            announce(console, [page])
            open_browser(page.url)

    def _wait_for_kernels(self) -> None:
        """Wait for the kernels that the algorithms need, with a first map in the web UI."""
        if self._compilation.busy:
            self.system.loop.run(until_ns=self.system.loop.now_ns + FIRST_MAP_NS)
            page: Any = self.system.nodes.get("page")
            self._compilation.wait(show=page.show_progress if page else lambda _: None)
            self._began_ns = wall_ns()

    def _run_until(self, limit: float, done: Callable[[], bool]) -> bool:
        """Run until `done`, at most `limit` seconds of the robot's time; show the progress."""
        loop = self.system.loop
        end_ns = loop.now_ns + round(limit * SECOND)
        logged_ns = loop.now_ns
        with console.status("") as status:
            while not done() and loop.now_ns < end_ns and not self._aborted:
                loop.run(until_ns=min(end_ns, loop.now_ns + SECOND), until=done)
                status.update(self._progress())
                if not console.is_terminal and loop.now_ns - logged_ns >= LOG_PERIOD:
                    console.print(self._progress())
                    logged_ns = loop.now_ns
        return done()

    def _progress(self) -> str:
        seconds, elapsed = self.system.loop.now_ns / 1e9, (wall_ns() - self._began_ns) / 1e9
        pose = self.scorer.last_ground_truth
        rate = f"{seconds:.0f} s, real-time factor {seconds / elapsed:.1f}"
        waits = not self.explored.done and self.explored.description.startswith(WAITS)
        fault = f"; {self.explored.description}" if waits else ""
        return f"{self._phase}: {rate}, at ({pose.x:.1f}, {pose.y:.1f}) m{fault}"

    def _announce_phase(self, sentence: str) -> None:
        self._phase = sentence
        console.print(f"[{self.system.loop.now_ns / 1e9:7.1f} s] {sentence}")
        self._publish_external("phase", String(sentence + "."))

    def _publish_external(self, topic: str, message: Any) -> None:
        """Publish as the web UI does, as a device, so that a replay finds the message in the recording."""
        loop = self.system.loop
        loop.post(lambda: loop.publish(topic, message, "person", from_device=True))

    def _on_publication(self, publication: Publication) -> None:
        message = publication.message
        if isinstance(message, ExplorationStatus):
            self.explored = message
        elif publication.topic == "localized" and isinstance(message, Bool):
            self.localized = message.data
        elif isinstance(message, DiagnosticArray):
            self.fault = first_fault_sentence(message) or self.fault

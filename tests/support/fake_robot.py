"""Serves a web UI for a robot that does not exist: it shows what a test sets and acts out deliveries."""

from __future__ import annotations

import base64
import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs.maps import MapEditResult
from chefbot.ui.commands import (
    ChangeQueue,
    DeletePlace,
    Deliver,
    Follow,
    Goal,
    Loaded,
    OperatorCommand,
    Patrol,
    PutPlace,
    SendMap,
)
from chefbot.ui.display.views import (
    CauseView,
    DeliveryView,
    LaunchView,
    MapBundleView,
    StatusView,
    WaitingOrderView,
)
from chefbot.ui.server import WebUiServer

PLACES = {
    "home": (0.0, 0.0, 0.0),
    "kitchen": (1.0, 2.0, 0.5),
    "table_1": (2.0, 0.0, 0.0),
    "table_2": (3.0, 0.0, 0.0),
}
LABELS = {"table_2": "窗边 2"}
STEP = 0.15
"""Duration of a step of a delivery in seconds, longer than the period of the web UI, so that each is sent."""


class FakeRobot:
    """A robot whose delivery ends as `fate`: "home", "failed", "cancelled", "behind", "refused", "flat" or
    "unreachable".

    "behind" means that it waits for another order, which fails; "flat", that the battery does not suffice for the
    order; "unreachable", that each goal fails at once.
    """

    def __init__(self, fate: str = "home") -> None:
        self.fate = fate
        self.commands: queue.Queue[OperatorCommand] = queue.Queue()
        self.server = WebUiServer(0, "127.0.0.1", self._receive)
        self.url = self.server.start()
        self.port = urlsplit(self.url).port or 0
        self.server.set_layer("status", StatusView(phase="Waiting."))
        self._failures = 0
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def stop(self) -> None:
        self._stopping.set()
        self.server.stop()
        for thread in self._threads:
            thread.join()

    def show_places(self) -> None:
        self.server.set_layer("labels", LABELS)
        self.server.set_layer("places", PLACES)

    def show_waiting_for_order(self) -> None:
        self._show("idle", "Waiting for an order.")

    def show_stop(self, sentence: str) -> None:
        stop = CauseView(id=2, time=9.0, ended=None, effect="Stopped", sentence=sentence)
        over = CauseView(id=1, time=1.0, ended=2.0, effect="Stopped", sentence="Something was near.")
        self.server.set_layer("causes", (stop, over))

    def show_failures(self, count: int, reason: str) -> None:
        self._failures = count
        self.server.set_layer("status", StatusView(failures=count, reason=reason))

    def show_map(self) -> Grid:
        cells = np.random.default_rng(3).choice(np.array([-1, 0, 100], np.int8), size=(30, 40))
        grid = Grid(cells, 0.05, -1.0, -0.5)
        self.server.set_layer("map", grid)
        return grid

    def show_mapping(self, bundle: bytes) -> None:
        """Show that a map is being made; the bundle is sent on request, the map in it need not be the one shown."""
        self._bundle = bundle
        self.server.set_layer("launch", LaunchView(mapping=True))

    def _receive(self, command: OperatorCommand, _: str) -> None:
        if self.fate == "refused":
            raise UserError("not today")
        self.commands.put(command)
        if isinstance(command, Goal | Patrol | Follow) and self.fate == "unreachable":
            self.show_failures(self._failures + 1, "The goal lies outside the map.")
        if isinstance(command, Loaded):
            self._show("driving", "On the way to table_1.")
        if isinstance(command, PutPlace | DeletePlace):
            self._change_place(command)
        if isinstance(command, SendMap):
            view = MapBundleView(id=command.id, bundle=base64.b64encode(self._bundle).decode())
            self.server.set_layer("map_bundle", view)
        if isinstance(command, ChangeQueue):
            self._show("driving", "On the way to kitchen.")
        if isinstance(command, Deliver):
            self._threads.append(threading.Thread(target=self._deliver, args=(command.tables,)))
            self._threads[-1].start()

    def _change_place(self, command: PutPlace | DeletePlace) -> None:
        problem = "table_9 lies in a wall" if command.name == "table_9" else ""
        self.server.set_layer("edits", (MapEditResult(command.id, not problem, problem),))

    def _deliver(self, tables: list[str]) -> None:
        if self.fate == "flat":
            self._show("failed", "Table_2 refused: the battery is at 4 % and has to be charged.")
            return
        if self.fate == "behind":
            order = WaitingOrderView(id="b", places=tuple(tables))
            for state in ("driving", "failed"):
                self._show(state, "table_9 was not reached.", orders=(order,), place="table_9")
        self._show("driving", "On the way to kitchen.", order_id="fake 1", queue=tuple(tables))
        for count, table in enumerate(tables):
            if self.fate == "cancelled" and count == 1:
                self._show("idle", "The delivery was cancelled.", tables[:count])
                return
            missed = self.fate == "failed" and count == 0
            self._show(
                "driving", f"On the way to {table}.", [] if missed else tables[:count], order_id="fake 1"
            )
        if self.fate == "followed":  # by the round of another order
            self._show("driving", "On the way to kitchen.", order_id="fake 2", queue=("table_9",))
            return
        self._show("returning", "On the way to home.", tables)
        if self.fate == "failed":
            self._show("failed", f"{tables[0]} was not reached.", tables[1:])
        else:
            self._show("idle", "At home, waiting for an order.", tables)

    def show_waiting_for_food(self) -> None:
        waiting = DeliveryView(
            state="loading", place="kitchen", waits_for="loaded", step="In the kitchen.", round_active=True
        )
        self.server.set_layer("delivery", waiting)

    def _show(
        self,
        state: str,
        sentence: str,
        delivered: list[str] | None = None,
        **fields: Any,
    ) -> None:
        view = DeliveryView(state=state, step=sentence, delivered=tuple(delivered or ()), **fields)
        self.server.set_layer("delivery", view)
        self._stopping.wait(STEP)


@contextmanager
def fake_robot(fate: str = "home") -> Iterator[FakeRobot]:
    """Run a fake robot and stop it on exit."""
    robot = FakeRobot(fate)
    try:
        yield robot
    finally:
        robot.stop()

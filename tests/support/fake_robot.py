"""A page with a robot behind it that is none: shows what a test says, and plays deliveries."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import numpy as np

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.ui.commands import Deliver, Loaded, OperatorCommand
from chefbot.ui.layers import DeliveryView, StatusView
from chefbot.ui.server import WebUiServer

PLACES = {
    "home": (0.0, 0.0, 0.0),
    "kitchen": (1.0, 2.0, 0.5),
    "table_1": (2.0, 0.0, 0.0),
    "table_2": (3.0, 0.0, 0.0),
}
STEP = 0.15
"""Seconds that a step of a delivery lasts: longer than the page's period, so that it is seen."""


class FakeRobot:
    """`fate`: "home", "failed", "cancelled", "behind" (another order, which fails), or "refused"."""

    def __init__(self, fate: str = "home") -> None:
        self.fate = fate
        self.heard: queue.Queue[OperatorCommand] = queue.Queue()
        self.server = WebUiServer(0, "127.0.0.1", self._receive)
        self.url = self.server.start()
        self.port = urlsplit(self.url).port or 0
        self.server.set_layer("status", StatusView(phase="Waiting."))
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def stop(self) -> None:
        self._stopping.set()
        self.server.stop()
        for thread in self._threads:
            thread.join()

    def know_places(self) -> None:
        self.server.set_layer("places", PLACES)

    def wait_for_orders(self) -> None:
        self._say("idle", "Waiting for an order.")

    def map_a_room(self) -> Grid:
        cells = np.random.default_rng(3).choice(np.array([-1, 0, 100], np.int8), size=(30, 40))
        grid = Grid(cells, 0.05, -1.0, -0.5)
        self.server.set_layer("map", grid)
        return grid

    def _receive(self, command: OperatorCommand) -> None:
        if self.fate == "refused":
            raise UserError("not today")
        self.heard.put(command)
        if isinstance(command, Loaded):
            self._say("driving", "On the way to table_1.")
        if isinstance(command, Deliver):
            self._threads.append(threading.Thread(target=self._deliver, args=(command.tables,)))
            self._threads[-1].start()

    def _deliver(self, tables: list[str]) -> None:
        if self.fate == "behind":
            for state in ("driving", "failed"):
                self._say(state, "table_9 was not reached.", orders=(tuple(tables),))
        self._say("driving", "On the way to kitchen.")
        for count, table in enumerate(tables):
            if self.fate == "cancelled" and count == 1:
                self._say("idle", "The delivery was cancelled.", tables[:count])
                return
            missed = self.fate == "failed" and count == 0
            self._say("driving", f"On the way to {table}.", [] if missed else tables[:count])
        self._say("returning", "On the way to home.", tables)
        if self.fate == "failed":
            self._say("failed", f"{tables[0]} was not reached.", tables[1:])
        else:
            self._say("idle", "At home, waiting for an order.", tables)

    def wait_for_food(self) -> None:
        waiting = DeliveryView(
            state="loading", place="kitchen", waits_for="loaded", step="In the kitchen.", round_active=True
        )
        self.server.set_layer("delivery", waiting)

    def _say(
        self,
        state: str,
        sentence: str,
        delivered: list[str] | None = None,
        orders: tuple[tuple[str, ...], ...] = (),
    ) -> None:
        view = DeliveryView(state=state, step=sentence, delivered=tuple(delivered or ()), orders=orders)
        self.server.set_layer("delivery", view)
        self._stopping.wait(STEP)


@contextmanager
def fake_robot(fate: str = "home") -> Iterator[FakeRobot]:
    """One that is stopped at the end."""
    robot = FakeRobot(fate)
    try:
        yield robot
    finally:
        robot.stop()

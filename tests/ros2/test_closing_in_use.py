"""A publisher or service client is closed while another thread uses it, as at the end of a node."""

from __future__ import annotations

import contextlib
import threading

import numpy as np
import zenoh

from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_srvs import Trigger, Trigger_Request
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

TRIES = 10


def close_in_use(use, close) -> None:  # type: ignore[no-untyped-def]
    """Close while a thread calls `use` again and again, which ends with the first call after the end."""
    began = threading.Event()

    def run() -> None:
        with contextlib.suppress(zenoh.ZError):
            while True:
                use()
                began.set()

    thread = threading.Thread(target=run)
    thread.start()
    began.wait()
    close()
    thread.join()


def test_a_publisher_is_closed_while_a_thread_publishes(wire: RmwContext) -> None:
    """A large message, so that the thread is within Zenoh nearly all of the time."""
    data = Image(width=1000, height=4000, step=1000, data=np.zeros(4_000_000, np.uint8)).to_cdr()
    with RmwNode(wire, "camera") as node, RmwNode(wire, "viewer") as viewer:
        viewer.subscription("image", Image, lambda _: None)
        for _ in range(TRIES):
            publisher = node.publisher("image", Image)
            close_in_use(lambda: publisher.publish_cdr(data), lambda: node.destroy(publisher))  # noqa: B023


def test_a_client_is_closed_while_a_thread_calls(wire: RmwContext) -> None:
    with RmwNode(wire, "robot") as node:
        for _ in range(TRIES):
            client = node.client("trigger", Trigger)
            close_in_use(lambda: client.call_async(Trigger_Request()), lambda: node.destroy(client))  # noqa: B023


def test_whether_there_are_subscribers_waits_for_no_publication(wire: RmwContext) -> None:
    """A control loop checks it, while a thread may be blocked by congestion within Zenoh."""
    with RmwNode(wire, "camera") as node:
        publisher, found = node.publisher("image", Image), list[bool]()
        check = threading.Thread(target=lambda: found.append(publisher.has_subscribers), daemon=True)
        with publisher._lock:
            check.start()
            check.join(10.0)
        assert found == [False]

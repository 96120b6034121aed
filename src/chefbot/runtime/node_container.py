"""A launch come to life: its nodes on a loop."""

from __future__ import annotations

from collections.abc import Callable, Container
from functools import partial
from typing import Any

import msgspec
from msgspec import Struct

from chefbot.config import build
from chefbot.errors import UserError, nearest
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import InvalidMessageError, check_stamp
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Fault, Faults
from chefbot.runtime.launch import Launch, NodeEntry, node_class, node_params
from chefbot.runtime.live_params import check_live
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import LAST_WORDS, Context, Device, Node, params_type
from chefbot.runtime.transform_buffer import TransformError, Transforms

LAUNCH_TOPIC = "chefbot/launch"
"""Every launch is told here, so that a log holds all that a replay needs."""
PARAMS_TOPIC = "chefbot/params"
"""So is every change of a running node's params: JSON `{"node": ..., "params": {...}}`, all of them."""


class _Params(Struct, frozen=True):
    node: str
    params: dict[str, Any]


_Plan = tuple[type[Node], Struct, dict[str, str]]


class System:
    """The nodes that run on one loop; launches can follow each other while devices stay."""

    def __init__(self, loop: Loop, robot: Robot, seed: int) -> None:
        self.loop = loop
        self.robot = robot
        self.seed = seed
        self.transforms = Transforms(loop.guarded)
        self.nodes: dict[str, Node] = {}
        self.faults: Faults | None = None
        """Of its nodes while they run; None: the first one ends the run."""
        for topic, static in (("tf", False), ("tf_static", True)):
            self.loop.subscribe(topic, "transforms", partial(self._receive, static))
        for topic in (PARAMS_TOPIC, LAST_WORDS + PARAMS_TOPIC):
            self.loop.subscribe(topic, "chefbot", self._take_params)

    def launch(self, launch: Launch, *, leave_out: Container[str] = ()) -> None:
        """Replace all nodes by those of `launch`. Devices of the same name stay as they are.

        All is checked before the first node is made. UserError when something does not fit.
        """
        plan = {name: self._prepare(launch.name, name, entry) for name, entry in launch.nodes.items()}
        self._stop_nodes({name for name in plan if isinstance(self.nodes.get(name), Device)})
        self.loop.publish(LAUNCH_TOPIC, String(launch.to_json()), "chefbot", from_device=True)
        made = []
        for name, (kind, params, remap) in plan.items():
            if name not in self.nodes and name not in leave_out:
                context = Context(name, self.loop, self.robot, self.transforms, self.seed, remap)
                self.nodes[name] = kind(context, params)
                made.append(self.nodes[name])
        self._start(made)

    def isolate(self, on_new: Callable[[Fault], None]) -> None:
        """From now on what a node raises costs no more than that callback; see `faults`."""
        self.faults = Faults(self.loop, on_new)

    def set_params(self, name: str, plain: dict[str, Any], publisher: str) -> None:
        """Give a running node other params; told as a message, so that a replay does the same.

        UserError when there is no such node, a value does not fit, or the node cannot change while running.
        """
        if name not in self.nodes:
            raise UserError(f"there is no node {name!r}{nearest(name, self.nodes)}")
        message = params_message(name, plain)
        self._reconfigure(message.data)
        self.loop.publish(PARAMS_TOPIC, message, publisher, from_device=True)

    def _take_params(self, message: Message) -> None:
        """Of a replay, or of a life before: there nobody has called `set_params`."""
        if isinstance(message, String):
            self._reconfigure(message.data)

    def _reconfigure(self, text: str) -> None:
        told = msgspec.json.decode(text, type=_Params)
        node = self.nodes.get(told.node)
        if node is None:
            return  # a replay leaves out what the log speaks for
        params = build(told.params, params_type(type(node)), f"node {told.node}: params")
        if params != node.params:
            check_live(node, params)
            node.reconfigure(params)

    def _start(self, made: list[Node]) -> None:
        """If one cannot, neither it nor those behind it are there any more: they have nothing to stop."""
        for count, node in enumerate(made):
            try:
                node.start()
            except BaseException:
                for idle in made[count:]:
                    Node.stop(self.nodes.pop(idle.name))
                raise

    def stop(self) -> None:
        """Stop every node."""
        self._stop_nodes(set())

    def _stop_nodes(self, staying: set[str]) -> None:
        """Stop all nodes but `staying`, and forget what they said."""
        for name in [name for name in self.nodes if name not in staying]:
            self.nodes.pop(name).stop()
        self.loop.forget_latched(staying)
        self.transforms.forget()

    def _prepare(self, launch: str, name: str, entry: NodeEntry) -> _Plan:
        where = f"launch {launch}: node {name}"
        kind = node_class(entry.kind, where)
        return kind, node_params(kind, entry.params, where), entry.remap

    def _receive(self, static: bool, message: Message) -> None:
        """UserError for what cannot be part of the tree: the message is at fault, not the program."""
        assert isinstance(message, TFMessage)
        try:
            if not static:
                check_stamp(message, self.loop.now_ns)
            self.transforms.receive(message, static)
        except (InvalidMessageError, TransformError) as error:
            raise UserError(str(error)) from None


def params_message(node: str, plain: dict[str, Any]) -> String:
    """What is said on PARAMS_TOPIC: all params of a node."""
    return String(msgspec.json.encode({"node": node, "params": plain}).decode())

"""The node container: it creates, starts and stops the nodes of a launch on one event loop."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from functools import partial
from typing import Any

import msgspec
from msgspec import Struct

from chefbot.config import build
from chefbot.errors import UserError, name_hint
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Fault, Faults
from chefbot.runtime.launch import Launch, NodeEntry, checked_node
from chefbot.runtime.live_params import check_live, check_safety
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import RESTORED_PREFIX, Context, Device, Node, params_type
from chefbot.runtime.node_restart import LOST_TOPIC, RECOVER_TOPIC, NodeRestarts, abort_goals, restored_state
from chefbot.runtime.transform_buffer import TransformBuffer

LAUNCH_TOPIC = "chefbot/launch"
"""Topic on which every launch is published, so that a log holds all that a replay needs."""
CONFIGURATION_TOPIC = "chefbot/configuration"
"""Topic of the whole launch in a process that runs a part of it."""
PARAMS_TOPIC = "chefbot/params"
"""Topic of parameter changes at run time: JSON `{"node": ..., "params": {...}}` with all parameters."""
RESTART_TOPIC = "chefbot/restart"
"""Topic of the names of nodes that are to be created again, as after the death of their process."""


class _NodeParams(Struct, frozen=True):
    node: str
    params: dict[str, Any]


_NodePlan = tuple[type[Node], Struct, dict[str, str]]


class NodeContainer:
    """The nodes that run on one loop; launches can replace each other while devices keep running."""

    def __init__(self, loop: Loop, robot: Robot, seed: int) -> None:
        self.loop = loop
        self.robot = robot
        self.seed = seed
        self.transforms = TransformBuffer(loop.isolated)
        self.nodes: dict[str, Node] = {}
        self._launched_params: dict[str, Struct] = {}
        self.faults: Faults | None = None
        """Counts exceptions of running nodes; None: the first exception ends the run."""
        for topic, static in (("tf", False), ("tf_static", True)):
            self.loop.subscribe(topic, "transforms", partial(self._on_tf, static))
        for topic in (PARAMS_TOPIC, RESTORED_PREFIX + PARAMS_TOPIC):
            self.loop.subscribe(topic, "chefbot", self._on_params)
        self.loop.subscribe(RESTART_TOPIC, "chefbot", self._on_restart)
        self.loop.subscribe(LOST_TOPIC, "chefbot", self._on_lost)
        self.loop.subscribe(RECOVER_TOPIC, "chefbot", self._on_recover)

    def launch(self, launch: Launch, *, leave_out: Container[str] = ()) -> None:
        """Replace all nodes by those of `launch`; devices of the same name keep running.

        Everything is checked before the first node is created. UserError if something is invalid.
        """
        plan = {name: self._prepare(launch.name, name, entry) for name, entry in launch.nodes.items()}
        self._stop_nodes({name for name in plan if isinstance(self.nodes.get(name), Device)})
        text = String(launch.to_json())
        self.loop.publish(LAUNCH_TOPIC, text, "chefbot", from_device=True, latched=True)
        created = []
        for name, (kind, params, remap) in plan.items():
            if name not in self.nodes and name not in leave_out:
                self._launched_params[name] = params
                created.append(self._create(kind, name, params, remap))
        self._start(created)

    def _create(self, kind: type[Node], name: str, params: Any, remap: Mapping[str, str]) -> Node:
        context = Context(name, self.loop, self.robot, self.transforms, self.seed, remap)
        self.nodes[name] = kind(context, params)
        return self.nodes[name]

    def _on_restart(self, message: Message) -> None:
        """Create a node again; its latched messages are gone, as with its process."""
        assert isinstance(message, String)
        node = self.nodes.get(message.data)  # None in a replay, for a node whose messages come from the log
        if node is not None:
            self._abort_goals(node)
            node.stop()
            self.loop.clear_latched({item.publisher for item in self.loop.latched()} - {node.name})
        if self.loop.interceptor is not None:
            self.loop.interceptor.restarted(message.data)
        if node is not None:
            self._create(type(node), node.name, node.params, node.context.remap).start()

    def _on_lost(self, message: Message) -> None:
        """Abort the goals of a node that does not run any more, for whose results others would wait forever."""
        assert isinstance(message, String)
        if message.data in self.nodes:
            self._abort_goals(self.nodes[message.data])

    def _abort_goals(self, lost: Node) -> None:
        others = [node for node in self.nodes.values() if node is not lost]
        abort_goals(self.loop, lost, others, f"Node {lost.name} does not run any more.")

    def _on_recover(self, message: Message) -> None:
        """Create a node again that keeps failing, with the state that it had published."""
        assert isinstance(message, String)
        node = self.nodes.get(message.data)
        if node is None:
            return  # a replay does not run the nodes whose messages come from the log
        state = restored_state(node, self.loop, self.transforms)
        self._on_restart(message)
        for publication in state:
            self.loop.redeliver(publication, lambda owner: owner == node.name)

    def _restart_after_bugs(self, name: str) -> None:
        if not isinstance(self.nodes.get(name), Device) and name in self.nodes:
            self._restarts.count_exception(name)

    def isolate_faults(self, on_new: Callable[[Fault], None]) -> None:
        """From now on limit the effect of a node's exception to the failing callback.

        A node that keeps failing is restarted. See `callback_faults`.
        """
        self.faults = Faults(self.loop, on_new)
        self._restarts = NodeRestarts(self.loop)
        self.faults.on_bug = self._restart_after_bugs

    def set_params(self, name: str, plain: dict[str, Any], publisher: str) -> None:
        """Change the parameters of a running node, and publish the change so that a replay repeats it.

        UserError if there is no such node, a value is invalid, or a parameter cannot change at run time.
        """
        if name not in self.nodes:
            raise UserError(f"there is no node {name!r}{name_hint(name, self.nodes)}")
        message = params_message(name, plain)
        self._reconfigure(message.data)
        self.loop.publish(PARAMS_TOPIC, message, publisher, from_device=True)

    def _on_params(self, message: Message) -> None:
        """Apply a parameter change that a replay, or the state restored after a restart, contains."""
        if isinstance(message, String):
            self._reconfigure(message.data)

    def _reconfigure(self, text: str) -> None:
        change = msgspec.json.decode(text, type=_NodeParams)
        node = self.nodes.get(change.node)
        if node is None:
            return  # a replay does not run the nodes whose messages come from the log
        params = build(change.params, params_type(type(node)), f"node {change.node}: params")
        if params != node.params:
            check_live(node, params)
            check_safety(node, self._launched_params[change.node], params)
            node.reconfigure(params)

    def _start(self, created: list[Node]) -> None:
        """Start the nodes.

        If one raises, it and all following nodes are removed, as they have nothing to stop.
        """
        for count, node in enumerate(created):
            try:
                node.start()
            except BaseException:
                for not_started in created[count:]:
                    Node.stop(self.nodes.pop(not_started.name))
                raise

    def stop(self) -> None:
        """Stop all nodes, including devices."""
        self._stop_nodes(set())

    def _stop_nodes(self, staying: set[str]) -> None:
        """Stop all nodes but `staying`, and drop their latched messages and the dynamic transforms."""
        for name in [name for name in self.nodes if name not in staying]:
            self.nodes.pop(name).stop()
        self.loop.clear_latched(staying)
        self.transforms.clear()

    def _prepare(self, launch: str, name: str, entry: NodeEntry) -> _NodePlan:
        kind, params = checked_node(launch, name, entry)
        return kind, params, entry.remap

    def _on_tf(self, static: bool, message: Message) -> None:
        """Add a message's transforms to the buffer; TransformError for an invalid one."""
        assert isinstance(message, TFMessage)
        self.transforms.add_transforms(message, static, self.loop.now_ns)


def params_message(node: str, plain: dict[str, Any]) -> String:
    """Return the message on PARAMS_TOPIC with all parameters of a node."""
    return String(msgspec.json.encode({"node": node, "params": plain}).decode())

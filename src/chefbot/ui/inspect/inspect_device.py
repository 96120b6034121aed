"""Base of the web UI's device: the ROS graph for engineers, while one of them looks at it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from chefbot.ros2.tools.inspector import Display, Inspector, Watch
from chefbot.ros2.tools.watched_parameters import ParameterChange
from chefbot.ui import commands as do
from chefbot.ui.access.audit_log import Kind
from chefbot.ui.editing.map_edit_device import MapEditDevice


class InspectDevice(MapEditDevice):
    """Shows nodes, topics with their newest messages, parameters and the log, as far as a page watches them."""

    def start(self) -> None:
        """Start without an inspection, until a page asks for one."""
        super().start()
        self._inspector = Inspector(Display(*(partial(self._show, layer) for layer in Display._fields)))

    def stop(self) -> None:
        """End the inspection that is running, if any."""
        self._inspector.close()
        super().stop()

    def _show(self, layer: str, value: object) -> None:
        self._server.set_layer(layer, value)

    def _inspect(self, command: do.Inspect | do.SetParameter, who: str) -> None:
        """Show the graph and what is watched for some seconds, or set a parameter. Raises ToolError for too much.

        who: gave the command; the audit log gets why a node refused it.
        """
        match command:
            case do.Inspect(topics, nodes):
                self._inspector.watch(Watch(tuple(topics), nodes))
            case do.SetParameter(node, name, value):
                self._inspector.set_parameter(
                    ParameterChange(node, name, value, self._refusal_of(command, who))
                )

    def _refusal_of(self, command: do.SetParameter, who: str) -> Callable[[str], None]:
        details = {"node": command.node, "name": command.name, "value": command.value}

        def record(reason: str) -> None:
            self.audit.record(Kind.COMMAND, (who, "", ""), "parameter refused", details, reason)

        return record

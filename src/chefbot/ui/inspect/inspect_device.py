"""Base of the web UI's device: the ROS graph for engineers, while one of them looks at it."""

from __future__ import annotations

from chefbot.ros2.tools.inspector import Inspector
from chefbot.ui import commands as do
from chefbot.ui.editing.map_edit_device import MapEditDevice


class InspectDevice(MapEditDevice):
    """Shows nodes, topics, and the newest messages of topics that a page watches."""

    def start(self) -> None:
        """Start without an inspection, until a page asks for one."""
        super().start()
        self._inspector = Inspector(
            lambda graph: self._server.set_layer("graph", graph),
            lambda values: self._server.set_layer("values", values),
        )

    def stop(self) -> None:
        """End the inspection that is running, if any."""
        self._inspector.close()
        super().stop()

    def _inspect(self, command: do.Inspect) -> None:
        """Show the graph and the watched topics for some seconds. Raises ToolError for too many topics."""
        self._inspector.watch(command.topics)

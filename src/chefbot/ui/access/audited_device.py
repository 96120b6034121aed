"""Base of a device that keeps the audit log: it records parameters that are changed from elsewhere, too."""

from __future__ import annotations

import msgspec

from chefbot.msgs.rcl_interfaces import ParameterEvent
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Device, In, Out, topic
from chefbot.runtime.node_container import PARAMS_TOPIC
from chefbot.ui.access.audit_log import AuditLog, Kind, audit_path

NETWORK = ("", "network", "")
"""Name, role and address in the audit log of nodes on the ROS network."""


class AuditedDevice(Device):
    """Keeps `audit`, the log of the robot's operators, from `start` to `stop`, and warnings about its own files."""

    parameter_events: In[ParameterEvent] = topic("/parameter_events")
    changed_params: In[String] = topic(PARAMS_TOPIC)
    notice: Out[String] = topic("page/notice")

    def start(self) -> None:
        """Open the audit log of the robot."""
        super().start()
        self.own_warnings: list[str] = []
        self.audit = AuditLog(audit_path(self.robot.name), self._warn, self._end_warning)

    def stop(self) -> None:
        """Write what waits, and close the log."""
        super().stop()
        self.audit.close()

    def on_parameter_events(self, event: ParameterEvent) -> None:
        """Record parameters that a node of another process accepted."""
        params = {parameter.name: parameter.value.plain for parameter in event.changed_parameters}
        self.audit.record(Kind.COMMAND, NETWORK, "parameter", {"node": event.node, "params": params})

    def on_changed_params(self, message: String) -> None:
        """Record all parameters of a node of this process after a change."""
        self.audit.record(Kind.COMMAND, NETWORK, "parameter", msgspec.json.decode(message.data))

    def _warn(self, sentence: str) -> None:
        """Publish a warning, and keep it for the web UI; thread-safe, and once for each sentence."""
        self.post(lambda: self._keep_warning(sentence))

    def _end_warning(self, sentence: str) -> None:
        """Show a warning no longer, as what it warned of has ended."""
        self.post(lambda: self.own_warnings.remove(sentence) if sentence in self.own_warnings else None)

    def _keep_warning(self, sentence: str) -> None:
        if sentence not in self.own_warnings:
            self.own_warnings.append(sentence)
            self.notice.publish(String(f"Warning: {sentence}."))

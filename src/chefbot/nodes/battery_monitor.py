"""The battery monitor node: what the battery allows, from its voltage and the odometry."""

from __future__ import annotations

from chefbot.battery.consumption import Consumption
from chefbot.battery.messages import log_message, log_of, reading_of, status_message
from chefbot.battery.monitor import BatteryLevel, BatteryMonitor
from chefbot.battery.pack import BatteryPack
from chefbot.battery.params import BatteryParams
from chefbot.design.sizing.energy_budget import driving_power, standing_power, usable_energy
from chefbot.msgs.chefbot_msgs import BatteryLog, BatteryStatus
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import BatteryState
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.motion_limits import max_speed
from chefbot.robot.spec import Robot
from chefbot.runtime.node import In, Node, Out, every, restored, topic

AVERAGE_SPEED = 0.6
"""Mean speed of a drive as a share of the maximum speed, before the log knows better."""
MOVING_SPEED, MOVING_TURN = 0.02, 0.05
"""Speed (m/s) and turn rate (rad/s) from which the robot is in motion."""
LOG_STEP = 0.01
"""Change of the charge after which the log is published again."""


class BatteryMonitorNode(Node):
    """Publishes `battery_status`, its warnings on /diagnostics, and the log that is kept over a restart."""

    live_params = ("*",)
    params: BatteryParams
    battery_state: In[BatteryState]
    odom: In[Odometry]
    stored_log: In[BatteryLog] = topic("battery/stored_log")
    restored_log: In[BatteryLog] = restored("battery/log")
    battery_status: Out[BatteryStatus] = topic(latched=True)
    log: Out[BatteryLog] = topic("battery/log", latched=True)
    diagnostics: Out[DiagnosticArray]
    notice: Out[String] = topic("battery/notice")

    def start(self) -> None:
        """Start with the consumption of the robot's sizing."""
        self._monitor = self._make_monitor(None, continued=False)
        self._distance = self._moving = 0.0
        self._odom_ns: int | None = None
        self._published_log: BatteryLog | None = None
        self._sentence = ""

    def reconfigure(self, params: BatteryParams) -> None:
        """Apply new shares from the next reading on."""
        self.params = self._monitor.params = params

    def on_stored_log(self, log: BatteryLog) -> None:
        """Start with what an earlier run has learnt, unless this process has learnt more since its restart."""
        if self.restored_log.last is None and not self._monitor.log.windows:
            self._monitor = self._make_monitor(log, continued=False)

    def on_restored_log(self, log: BatteryLog) -> None:
        """Continue after a restart of the process, during which the pack was not changed."""
        self._monitor = self._make_monitor(log, continued=True)

    def _make_monitor(self, log: BatteryLog | None, *, continued: bool) -> BatteryMonitor:
        pack = BatteryPack.of(self.robot, usable_energy(self.robot).value)
        known = log_of(log) if log is not None else None
        return BatteryMonitor(pack, self.params, prior_consumption(self.robot), known, continued=continued)

    def on_odom(self, odom: Odometry) -> None:
        """Add the distance and the time in motion since the last odometry."""
        stamp, twist = odom.header.stamp.ns, odom.twist.twist
        previous, self._odom_ns = self._odom_ns, stamp
        duration = min(1.0, max(0.0, (stamp - previous) / 1e9)) if previous is not None else 0.0
        speed = min(abs(twist.linear.x), max_speed(self.robot))
        if speed > MOVING_SPEED:
            self._distance += speed * duration
        if speed > MOVING_SPEED or abs(twist.angular.z) > MOVING_TURN:
            self._moving += duration

    def on_battery_state(self, state: BatteryState) -> None:
        """Update the monitor and publish what the battery allows."""
        self._monitor.update(reading_of(state, self.now_ns, self._distance, self._moving))
        self._distance = self._moving = 0.0
        self.battery_status.publish(status_message(self._monitor.assessment, self.now_ns))
        log, last = log_message(self._monitor.log, self.now_ns), self._published_log
        if last is None or last.windows != log.windows or not abs(last.charge - log.charge) < LOG_STEP:
            self._published_log = log
            self.log.publish(log)

    @every(hz=1)
    def report(self) -> None:
        """Publish the level as diagnostics, and in the terminal when it changes."""
        if self.battery_state.last is None:
            return
        known = self._monitor.assessment
        fine = known.level is BatteryLevel.OK and not known.voltage_fault
        status = DiagnosticStatus(OK if fine else WARN, "battery", known.description, self.robot.name)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))
        sentence = "" if fine else f"{known.level.value} {known.voltage_fault[:20]}"
        if sentence != self._sentence:
            self._sentence = sentence
            self.notice.publish(String(known.description))


def prior_consumption(robot: Robot) -> Consumption:
    """Return the consumption by the robot's sizing, loaded and on carpet."""
    seconds = 1.0 / (AVERAGE_SPEED * max_speed(robot))
    motors = driving_power(robot, total_mass(robot)).value
    return Consumption(standing_power(robot), motors / max_speed(robot), seconds)

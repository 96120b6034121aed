"""Messages of the battery monitor."""

from __future__ import annotations

from chefbot.battery.consumption import Consumption
from chefbot.battery.gauge import Reading
from chefbot.battery.monitor import BatteryAssessment, BatteryMemory
from chefbot.msgs import chefbot_msgs as msgs
from chefbot.msgs.sensor_msgs import BatteryState
from chefbot.msgs.std_msgs import Header

CHARGING, FULL = 1, 4
"""POWER_SUPPLY_STATUS_CHARGING and POWER_SUPPLY_STATUS_FULL of sensor_msgs/BatteryState."""


def reading_of(state: BatteryState, now_ns: int, distance: float, moving: float) -> Reading:
    """Return the reading of a state; sensor_msgs/BatteryState counts a current that is drawn as negative."""
    charging = state.power_supply_status in (CHARGING, FULL)
    return Reading(now_ns / 1e9, state.voltage, -state.current, distance, moving, charging)


def status_message(assessment: BatteryAssessment, now_ns: int) -> msgs.BatteryStatus:
    """Return the assessment as a message."""
    standing, per_metre, seconds = assessment.consumption
    return msgs.BatteryStatus(
        Header.of(now_ns, "base_link"),
        assessment.level.value,
        assessment.charge,
        assessment.energy,
        standing,
        per_metre,
        seconds,
        assessment.voltage_fault,
        assessment.description,
    )


def log_message(log: BatteryMemory, now_ns: int) -> msgs.BatteryLog:
    """Return what is kept over a restart as a message."""
    return msgs.BatteryLog(Header.of(now_ns, ""), *log.consumption, log.charge, log.measured, log.windows)


def log_of(message: msgs.BatteryLog) -> BatteryMemory:
    """Return what a message keeps."""
    learnt = Consumption(message.standing_power, message.energy_per_metre, message.seconds_per_metre)
    return BatteryMemory(learnt, message.charge, message.measured, message.windows)

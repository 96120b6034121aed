"""The topics of every motor board, real or simulated."""

from __future__ import annotations

from typing import Any

from chefbot.msgs.chefbot_msgs import WheelSpeeds, WheelTicks
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import BatteryState, Imu, Range
from chefbot.msgs.std_msgs import Bool, String
from chefbot.runtime.node import Device, In, Out, topic


class MotorBoardNode(Device):
    """Base of motor board devices: subscribes wheel speeds and emergency stop; publishes ticks, IMU,
    ultrasonic, cliff sensors, battery, diagnostics, whether the board accepts commands and why its motors are off."""

    wheel_speeds: In[WheelSpeeds]
    emergency_stop: In[Bool]
    wheel_ticks: Out[WheelTicks]
    imu: Out[Imu] = topic("imu/data")
    ultrasonic: Out[Range]
    cliff: Out[Range]
    battery_state: Out[BatteryState]
    diagnostics: Out[DiagnosticArray]
    board_connected: Out[Bool] = topic(latched=True)

    board_fault: Out[String] = topic(latched=True)

    _is_connected, _fault = False, ""

    @property
    def board_outputs(self) -> tuple[Out[Any], ...]:
        """All outputs of a motor board, to be withdrawn where another device takes its place."""
        sensors = self.wheel_ticks, self.imu, self.ultrasonic, self.cliff, self.battery_state
        return *sensors, self.diagnostics, self.board_connected, self.board_fault

    def publish_connection(self, connected: bool) -> None:
        """Publish whether the board accepts commands if that has changed; nothing before it first does."""
        if connected != self._is_connected:
            self._is_connected = connected
            self.board_connected.publish(Bool(connected))

    def publish_fault(self, sentence: str) -> None:
        """Publish why the board has switched its motors off if that has changed; empty if it has not."""
        if sentence != self._fault:
            self._fault = sentence
            self.board_fault.publish(String(sentence))

    def publish_sensor_message(self, message: Message) -> None:
        """Publish a sensor message on the topic of its type; TypeError for a type without one."""
        if isinstance(message, WheelTicks):
            self.wheel_ticks.publish(message)
        elif isinstance(message, Imu):
            self.imu.publish(message)
        elif isinstance(message, Range):
            (self.cliff if message.radiation_type == Range.INFRARED else self.ultrasonic).publish(message)
        elif isinstance(message, BatteryState):
            self.battery_state.publish(message)
        else:
            raise TypeError(
                f"the board protocol returned a {type(message).__name__}, which has no topic here"
            )

"""What every motor board hears and tells, the built one and the simulated one."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import WheelSpeeds, WheelTicks
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import BatteryState, Imu, Range
from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.node import Device, In, Out, topic


class BoardNode(Device):
    """Wheel speeds and STOP down; ticks, IMU, ultrasonic, battery and health up."""

    wheel_speeds: In[WheelSpeeds]
    emergency_stop: In[Bool]
    wheel_ticks: Out[WheelTicks]
    imu: Out[Imu] = topic("imu/data")
    ultrasonic: Out[Range]
    battery_state: Out[BatteryState]
    diagnostics: Out[DiagnosticArray]

    def publish_sensed(self, message: Message) -> None:
        """A message of the board's line on the topic of its type; TypeError for one that has none."""
        if isinstance(message, WheelTicks):
            self.wheel_ticks.publish(message)
        elif isinstance(message, Imu):
            self.imu.publish(message)
        elif isinstance(message, Range):
            self.ultrasonic.publish(message)
        elif isinstance(message, BatteryState):
            self.battery_state.publish(message)
        else:
            raise TypeError(f"the board's line gave a {type(message).__name__}, which has no topic here")

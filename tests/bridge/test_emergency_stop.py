"""STOP over the wire: its owner dies, subscribers join late, and there is one answer to how the robot stands."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from tests.chaos.launch_process import LaunchProcess, run_chefbot, wait_for

from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.safety.stop_latch import ESTOP_RESTORED

LAUNCH = """
description: The gate before the wheels in a process of its own.
clock: wall
nodes:
  odometry: {kind: "chefbot.nodes.odometry:OdometryNode"}
  base: {kind: "chefbot.nodes.drive_base:DriveBaseNode", process: gate}
"""


class Late:
    """A late-joining subscriber in a process's session of its own."""

    def __init__(self, port: int) -> None:
        self._wire = RmwContext(port=port, router=False)
        self._node = RmwNode(self._wire, "late")
        self.states: list[bool] = []
        self.why: list[EmergencyStopStatus] = []
        self._node.subscription(
            "/emergency_stop", Bool, lambda one: self.states.append(one.data), TRANSIENT_LOCAL_QOS
        )
        self._node.subscription("/stop_status", EmergencyStopStatus, self.why.append, TRANSIENT_LOCAL_QOS)

    def first(self) -> bool:
        """The state that it receives; one and no other."""
        wait_for(lambda: self.states and self.why)
        found = self.states[0]
        assert self.states == [found] and self.why[0].active is found
        self.close()
        return found

    def close(self) -> None:
        self._node.close()
        self._wire.close()


class Gate:
    """The launch above, two people who can press STOP, and one who drives."""

    def __init__(self, one: LaunchProcess, node: RmwNode) -> None:
        self.one, self.node = one, node
        self.speeds: list[float] = []
        self.people = [node.publisher("/stop_request", Bool) for _ in range(2)]
        self._driver = node.publisher("/cmd_vel_teleop", Twist)
        self._states: list[bool] = []
        node.subscription(
            "/emergency_stop", Bool, lambda state: self._states.append(state.data), TRANSIENT_LOCAL_QOS
        )
        node.subscription("/wheel_speeds", WheelSpeeds, lambda wheels: self.speeds.append(wheels.left))
        self.wait_until_there()

    def wait_until_there(self) -> None:
        wait_for(lambda: all(one.has_subscribers for one in (*self.people, self._driver)))

    def request(self, person: Publisher[Bool], stop: bool) -> None:
        """Whoever comes before the base has answered would receive the old state and the new one."""
        person.publish(Bool(stop))
        wait_for(lambda: self._states and self._states[-1] is stop)
        assert Late(self.one.port).first() is stop

    def kill(self) -> None:
        """And wait until it is restarted."""
        killed = self.one.inject("killed", "gate")
        wait_for(lambda: not self.people[0].has_subscribers)
        wait_for(lambda: self.one.child("gate") not in (None, killed))
        self.wait_until_there()

    def moves(self) -> bool:
        """Where somebody takes the stick for half a second."""
        time.sleep(0.5)
        count = len(self.speeds)
        for _ in range(10):
            self._driver.publish(Twist.of(0.2, 0.0))
            now = len(self.speeds)
            wait_for(lambda now=now: len(self.speeds) > now)
        return any(speed > 0.0 for speed in self.speeds[count:])


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_late_subscribers_and_restarted_bases_get_the_stop_state(tmp_path: Path) -> None:
    path = tmp_path / "gate.yaml"
    path.write_text(LAUNCH)
    with run_chefbot("launch", str(path)) as (one, node):
        gate = Gate(one, node)
        first, second = gate.people
        assert Late(one.port).first() is False and gate.moves()
        for person, stop in ((first, True), (second, False), (first, True)):
            gate.request(person, stop)
        assert not gate.moves()
        gate.kill()
        late = Late(one.port)
        assert late.first() is True and late.why[0].description == ESTOP_RESTORED
        assert not gate.moves()
        gate.request(second, False)
        assert gate.moves()
        gate.kill()
        assert Late(one.port).first() is False and gate.moves()  # who was not stopped goes on
        assert ESTOP_RESTORED in one.stop()

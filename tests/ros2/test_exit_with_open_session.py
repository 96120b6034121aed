"""Programs that end without closing the wire."""

from __future__ import annotations

import subprocess
import sys

from tests.chaos.launch_process import free_port
from tests.support.waiting import wait_for

from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

LEAVES = """
import sys, time
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

received = []
wire = RmwContext(port=int(sys.argv[1]), router=False)
RmwNode(wire, "leaves").subscription("talk", String, received.append)
while len(received) < 10:
    time.sleep(0.01)
sys.exit(3)
"""


def test_a_program_exits_while_messages_arrive() -> None:
    port = free_port()
    with RmwContext(port=port) as wire, RmwNode(wire, "talks") as node:
        talk = node.publisher("talk", String)
        program = subprocess.Popen([sys.executable, "-c", LEAVES, str(port)])

        def ended() -> bool:
            talk.publish(String("on and on"))
            return program.poll() is not None

        try:
            wait_for(ended, "its end")
            assert program.returncode == 3
        finally:
            program.kill()
            program.wait()

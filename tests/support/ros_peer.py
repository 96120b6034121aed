"""A process with a node that echoes topics and has a latched topic, a service and an action, until its input ends."""

from __future__ import annotations

import sys
import threading
import time

from chefbot.msgs.action_msgs import STATUS_CANCELED, STATUS_SUCCEEDED
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Feedback, NavigateToPose_Result
from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import String
from chefbot.msgs.std_srvs import SetBool, SetBool_Response
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.service import ServiceCall
from chefbot.ros2.rmw.session import RmwContext


class NavigationServer:
    """An action server whose goals take three steps, or end when they are cancelled."""

    def __init__(self, node: RmwNode) -> None:
        self.cancelled = threading.Event()
        self.server = ActionServer(
            node, "navigate_to_pose", NavigateToPose, self.accept, lambda _: not self.cancelled.set()
        )

    def accept(self, goal_id: Message, goal: Message) -> bool:
        if goal.behavior_tree == "unwanted":
            return False
        self.cancelled.clear()
        threading.Thread(target=self.run, args=(goal_id, goal.behavior_tree), daemon=True).start()
        return True

    def run(self, goal_id: Message, speed: str) -> None:
        self.server.execute(goal_id)
        for step in range(600 if speed == "slow" else 3):
            self.server.publish_feedback(goal_id, NavigateToPose_Feedback(distance_remaining=float(3 - step)))
            if self.cancelled.wait(0.05):
                self.server.finish(goal_id, STATUS_CANCELED, NavigateToPose_Result())
                return
        self.server.finish(goal_id, STATUS_SUCCEEDED, NavigateToPose_Result(0, "there"))


def answer(call: ServiceCall) -> None:
    """Respond to a service call."""
    call.respond(SetBool_Response(call.request.data, "from the other process"))


def main(port: int, router: bool) -> None:
    """Run the node until standard input ends."""
    with RmwContext(port=port, router=router) as wire, RmwNode(wire, "other", "/far") as node:
        echo = node.publisher("echo", Twist)
        node.subscription("twist", Twist, echo.publish)
        image = node.publisher("image_back", Image)
        node.subscription("image", Image, image.publish)
        node.publisher("latched", String, TRANSIENT_LOCAL_QOS).publish(String("early"))
        node.server("switch", SetBool, answer)
        NavigationServer(node)
        until = time.monotonic() + 10
        while not wire.connected and time.monotonic() < until:
            time.sleep(0.01)
        sys.stdout.write("router\n" if wire.is_router else "peer\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2] == "router")

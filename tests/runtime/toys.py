"""Small nodes for testing the runtime."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal, Deliver_Result, WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Float64, String
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.node import Device, In, Node, NoParams, Out, every, topic


class CounterParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    step: Annotated[float, Meta(gt=0, le=10, description="m")] = 1.0


class Counter(Device):
    """A device that counts at 10 Hz."""

    params: CounterParams
    count: Out[Float64]

    def start(self) -> None:
        self.value = 0.0

    @every(hz=10)
    def tick(self) -> None:
        self.value += self.params.step
        self.count.publish(Float64(self.value))


class Source(Device):
    """Counts at 20 Hz, from 1 at 50 ms."""

    params: NoParams
    count: Out[Float64]

    @every(hz=20)
    def tick(self) -> None:
        self.count.publish(Float64(round(self.now_ns / 50_000_000)))


class Doubler(Node):
    params: NoParams
    count: In[Float64]
    double: Out[Float64]

    def on_count(self, message: Float64) -> None:
        self.double.publish(Float64(2.0 * message.data))


class Wheels(Device):
    """What a motor board is to the rest: it obeys wheel speeds, and shows what it obeyed."""

    params: NoParams
    wheel_speeds: In[WheelSpeeds]
    obeyed: Out[Float64]

    def on_wheel_speeds(self, message: WheelSpeeds) -> None:
        self.obeyed.publish(Float64(message.left))


class Base(Node):
    """Publishes what it commands."""

    params: NoParams
    cmd_vel: Out[Twist]


class Dice(Node):
    """Adds random numbers to what it receives, and publishes from a timer."""

    params: NoParams
    double: In[Float64]
    dice: Out[Float64]

    def start(self) -> None:
        self.rng = self.context.rng()

    @every(hz=7)
    def throw(self) -> None:
        received = self.double.last.data if self.double.last else 0.0
        self.dice.publish(Float64(received + self.rng.random()))


class Cook(Node):
    """Serves food, one dish a second."""

    params: NoParams
    deliver = action_server(Deliver)
    dishes: Out[String] = topic(latched=True)

    async def on_deliver(self, goal: Deliver_Goal, _: object) -> Deliver_Result:
        done = []
        for place in goal.places:
            await self.sleep(1.0)
            self.dishes.publish(String(place))
            done.append(place)
        return Deliver_Result(tuple(done))


class Guest(Node):
    """Orders at once and remembers what came of it."""

    params: NoParams
    deliver = action_client(Deliver)

    def start(self) -> None:
        self.results: list[object] = []
        self.task = self.spawn(self.order(("soup", "salad")))

    async def order(self, dishes: tuple[str, ...]) -> None:
        self.results.append(await self.deliver.call(Deliver_Goal(dishes)))


class MapServer(Node):
    """Publishes a map."""

    map: Out[OccupancyGrid] = topic(latched=True)


class MapUser(Node):
    """Needs a map."""

    map: In[OccupancyGrid]

"""Tests that running nodes accept the parameters that they declare as settable and reject others with a reason."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from msgspec import inspect as types

from chefbot.config import ConfigError
from chefbot.errors import UserError
from chefbot.launcher.session import session, start
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry, built_in_launches, load_launch, node_class, node_params
from chefbot.runtime.live_params import SMALLER, is_live, safer_directions
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.param_values import flatten, with_values

ENTRIES = {entry.kind: entry for name in built_in_launches() for entry in load_launch(name).nodes.values()}
NODES = ("amcl", "base", "controller", "delivery", "explorer", "gmapping", "navigator", "planner")
SECOND = 1_000_000_000


@pytest.mark.parametrize("kind", sorted(ENTRIES))
def test_settable_parameters_exist(kind: str) -> None:
    found = node_class(kind, kind)
    names = flatten(node_params(found, ENTRIES[kind].params, kind))
    for pattern in found.live_params:
        assert any(is_live(name, (pattern,)) for name in names), pattern


def other_value(value: Any, kind: types.Type) -> Any:
    """Return another value within the bounds; None for a type or bounds that are not supported."""
    kind = kind.type if isinstance(kind, types.Metadata) else kind
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value}_2" if value else None
    if not isinstance(kind, (types.FloatType, types.IntType)):
        return None
    low = kind.ge if kind.ge is not None else kind.gt
    high = kind.le if kind.le is not None else kind.lt
    if low is None or high is None:
        return None
    near = value + type(value)(1) if isinstance(value, int) else 0.9 * value + 0.1 * high
    return near if low < near < high else value - 1 if isinstance(value, int) else 0.9 * value + 0.1 * low


def start_nodes() -> NodeContainer:
    modules = {"base": "drive_base"}
    kinds = {
        name: f"{modules.get(name, name)}:{'DriveBase' if name == 'base' else name.capitalize()}Node"
        for name in NODES
    }
    entries = {name: NodeEntry(kind=f"chefbot.nodes.{kind}") for name, kind in kinds.items()}
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 1)
    system.launch(Launch(name="test", description="", args={}, nodes=entries))
    return system


def test_each_parameter_is_set_or_rejected_with_the_reason() -> None:
    system, accepted, rejected, refused = start_nodes(), 0, 0, 0
    for name, node in system.nodes.items():
        for param, current in flatten(node.params).items():
            value = other_value(current.value, current.kind)
            if value is None or value == current.value:
                continue
            plain = with_values(node.params, {param: value})
            safer = safer_directions(type(node.params)).get(param)
            if safer and (value < current.value) != (safer == SMALLER):
                with pytest.raises(UserError, match=f"{name} keeps {param} at .*in the launch"):
                    system.set_params(name, plain, "test")
                refused += 1
                value = current.value * (0.9 if safer == SMALLER else 1.1)
                plain = with_values(node.params, {param: value})
            if is_live(param, node.live_params):
                system.set_params(name, plain, "test")
                assert flatten(node.params)[param].value == pytest.approx(value), (name, param)
                accepted += 1
            else:
                with pytest.raises(UserError, match=f"{name} reads {param} when it starts"):
                    system.set_params(name, plain, "test")
                assert flatten(node.params)[param].value == current.value
                rejected += 1
    system.stop()
    assert accepted > 40 and rejected > 40 and refused == 3


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_lower_speed_parameter_slows_the_robot() -> None:
    given = {"robot": "chefbot_lidar", "world": "room", "people": "0", "pictures": "0", "headless": "true"}
    launch = load_launch("gmapping_demo", given)
    robot = load_robot("chefbot_lidar")
    with session(robot, 1, "simulation", 0.0, None) as system:
        start(system, launch)
        fastest = [0.0]

        def keep_fastest(message: Message) -> None:
            assert isinstance(message, Twist)
            fastest[0] = max(fastest[0], message.linear.x)

        system.loop.subscribe("cmd_vel", "test", keep_fastest)
        system.loop.run(until_ns=4 * SECOND)
        top = {}
        for share, x in ((0.4, 1.2), (1.0, 0.0)):
            params = msgspec.to_builtins(system.nodes["controller"].params) | {"speed": share}
            system.set_params("controller", params, "test")
            fastest[0] = 0.0
            goal = PoseStamped(Header.of(system.loop.now_ns, "map"), Pose.of(SE2(x, 0.0, 0.0)))
            system.loop.post(lambda goal=goal: system.loop.publish("goal_pose", goal, "test"))
            system.loop.run(until_ns=system.loop.now_ns + 15 * SECOND)
            top[share] = fastest[0] / max_speed(robot)
    assert 0.3 < top[0.4] < 0.41
    assert 0.7 < top[1.0] <= 1.0


@pytest.mark.parametrize("timeout", [0.6, 5.0, 1e9])
def test_no_parameter_disables_the_command_timeout(timeout: float) -> None:
    """Without a timeout the robot would continue at full speed when commands cease."""
    system = start_nodes()
    plain = with_values(system.nodes["base"].params, {"limiter.timeout": timeout})
    with pytest.raises(ConfigError, match="timeout"):
        system.set_params("base", plain, "test")
    system.stop()


def test_a_stricter_value_can_be_taken_back_to_the_launch() -> None:
    system = start_nodes()
    node = system.nodes["base"]
    for timeout in (0.1, 0.3):
        system.set_params("base", with_values(node.params, {"limiter.timeout": timeout}), "test")
        assert flatten(node.params)["limiter.timeout"].value == timeout
    with pytest.raises(UserError, match=r"0\.31: a parameter of safety cannot become larger"):
        system.set_params("base", with_values(node.params, {"limiter.timeout": 0.31}), "test")
    system.loop.publish("chefbot/restart", String("base"), "test", from_device=True)
    system.loop.run(until_ns=system.loop.now_ns + SECOND)
    with pytest.raises(UserError, match=r"base keeps limiter\.timeout"):
        system.set_params("base", with_values(system.nodes["base"].params, {"limiter.timeout": 0.31}), "test")
    system.stop()

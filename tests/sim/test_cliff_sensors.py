"""Cliff sensors in the simulator: from the hole in the world through the firmware to the wheels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.cliff_sensors import SimulatedCliffSensors
from chefbot.sim.world.load import load_any_world

ROBOT = load_robot("chefbot_cliff")
WITH_LIDAR = msgspec.structs.replace(
    ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, lidar=load_robot("chefbot_lidar").sensors.lidar)
)
"""A robot that sees the ground behind it: without a lidar it does not back up over ground that it never saw."""
NO_CAMERA: dict[str, Any] = {"monitor": {"optional_sensors": ["depth camera"]}}
"""Parameters of a base to which no image comes: the cliff sensors alone know of the step."""
WORLD = """name: edge
walls: [{start: [-4 m, -4 m], end: [-4 m, 4 m]}, {start: [5 m, -4 m], end: [5 m, 4 m]}]
holes: [{name: step, x: 2 m, y: 0 m, size: [4 m, 8 m], depth: DEPTH}]
places: {home: {x: -0.8 m, y: 0 m, yaw: YAW deg}}
"""


def world(folder: Path, depth: str = "0.03 m", yaw: float = 0.0) -> Path:
    path = folder / "edge.yaml"
    path.write_text(WORLD.replace("DEPTH", depth).replace("YAW", str(yaw)))
    return path


@pytest.mark.parametrize(
    ("pose", "depth", "cliffs"),
    [
        (SE2(-0.2, 0.0, 0.0), "0.03 m", 0),
        (SE2(-0.12, 0.0, 0.0), "0.03 m", 1),
        (SE2(-0.05, 0.0, 0.0), "0.03 m", 7),
        (SE2(-0.05, 0.0, 0.0), "0.01 m", 0),
        (SE2(-0.12, 0.0, 3.1416), "0.03 m", 8),
        (SE2(-0.12, 0.0, 0.78), "0.17 m", 4),
    ],
)
def test_sensors_over_a_hole_see_no_floor(tmp_path: Path, pose: SE2, depth: str, cliffs: int) -> None:
    loaded = load_any_world(str(world(tmp_path, depth)), ROBOT)
    assert SimulatedCliffSensors(ROBOT, loaded).measure(pose) == cliffs
    assert SimulatedCliffSensors.of(load_robot("chefbot"), loaded) is None


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize(("yaw", "v"), [(0.0, 0.35), (45.0, 0.35), (180.0, -0.2), (20.0, 0.2)])
def test_teleoperation_stops_at_a_step(tmp_path: Path, yaw: float, v: float) -> None:
    system = NodeContainer(Loop(StepClock()), ROBOT if v > 0.0 else WITH_LIDAR, 1)
    params: dict[str, Any] = {"world": str(world(tmp_path, "0.17 m", yaw)), "people": 0, "picture_hz": 0}
    nodes = {
        "simulator": NodeEntry(kind="chefbot.sim.device:SimulatorDevice", params=params),
        "base": NodeEntry(kind="chefbot.nodes.drive_base:DriveBaseNode", params=NO_CAMERA),
    }
    notices: list[str] = []
    keep = lambda p: notices.append(p.message.data) if isinstance(p.message, String) else None  # noqa: E731
    system.loop.add_observer(keep)
    system.launch(Launch(name="teleoperated", description="", args={}, nodes=nodes))
    simulator: Any = system.nodes["simulator"]
    for _ in range(250):
        system.loop.publish("cmd_vel_teleop", Twist.of(v, 0.0), "test")
        system.loop.run(until_ns=system.loop.now_ns + 100_000_000)
    truth = simulator.simulation.truth()
    system.stop()
    assert simulator.simulation.tilt < 0.05 and abs(truth.v) < 0.01
    assert -0.25 < truth.pose.x < -0.08  # it came there, and its wheels stand on the floor
    assert any("sees no floor" in notice for notice in notices)

"""Glass, mirrors, holes and carpets, as sensors and wheels meet them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.buildings.world_file import BoxSpec, Carpet, FloorHole, NamedPose, Wall, WorldSpec
from chefbot.design.export.mjcf import PHYSICS_STEP
from chefbot.errors import UserError
from chefbot.maths.grid import FREE
from chefbot.robot.load import load_robot
from chefbot.sim.cameras.depth_camera import DepthRenderer
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.world import World, build_world

ROBOT = load_robot("chefbot_lidar")


def room(**elements: object) -> World:
    """Return a room of 8 by 4 m around (2, 0), where the robot starts at (0, 0)."""
    corners = [[-2.0, -2.0], [6.0, -2.0], [6.0, 2.0], [-2.0, 2.0]]
    walls = [Wall(start=a, end=b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    spec = WorldSpec(name="room", walls=walls, places={"home": NamedPose(x=0.0, y=0.0)}, **elements)  # type: ignore[arg-type]
    return build_world(spec, "room")


def pane(material: str, x: float = 2.0, yaw: float = 0.0) -> BoxSpec:
    return BoxSpec(name="pane", x=x, y=0.0, yaw=yaw, size=[0.02, 3.0, 2.0], material=material)  # type: ignore[arg-type]


def drive(sim: Simulation, duty: float, seconds: float) -> None:
    sim.set_duty(duty, duty)
    for _ in range(round(seconds / PHYSICS_STEP)):
        sim.step()


def lidar(world: World) -> np.ndarray:
    return np.asarray(Simulation(ROBOT, world).lidar(), np.float64)


def bearing(degrees: float) -> int:
    """Return the beam nearest to a bearing."""
    return int(np.argmin(np.abs(lidar_angles(ROBOT.sensors.lidar) - math.radians(degrees))))  # type: ignore[arg-type]


def test_a_laser_passes_glass_but_for_a_right_angle() -> None:
    empty, glazed = lidar(room()), lidar(room(boxes=[pane("glass")]))
    assert glazed[bearing(0.0)] == pytest.approx(2.0 - 0.01 - ROBOT.sensors.lidar.mount.x, abs=0.01)  # type: ignore[union-attr]
    for degrees in (10.0, 20.0, 30.0, -15.0):
        assert glazed[bearing(degrees)] == pytest.approx(empty[bearing(degrees)], abs=1e-6)


def test_sound_does_not_pass_glass() -> None:
    distance = Simulation(ROBOT, room(boxes=[pane("glass")])).echo()
    assert distance < 2.0


def test_a_laser_sees_the_room_behind_a_mirror() -> None:
    yaw = math.radians(20.0)  # turned mirror: the beam straight ahead goes to the upper wall
    mirrored = lidar(room(boxes=[pane("mirror", yaw=yaw)]))
    solid = lidar(room(boxes=[pane("solid", yaw=yaw)]))
    to_mirror = solid[bearing(0.0)]
    # the reflected beam runs at 180 + 40 degrees: down to the wall at y = -1.94
    assert mirrored[bearing(0.0)] == pytest.approx(to_mirror + 1.94 / math.sin(2.0 * yaw), abs=0.03)


def test_a_camera_sees_through_glass_and_nothing_in_a_mirror() -> None:
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    middle = (camera.height // 3, camera.width // 2)
    depth = {}
    for material in ("solid", "glass", "mirror"):
        world = room(boxes=[pane(material)])
        frame = DepthRenderer(camera).frame(Simulation(ROBOT, world).capture(), 0, colour=True)
        depth[material] = float(frame.depth[middle])
        assert frame.colour is not None
    assert depth["solid"] == pytest.approx(2.0, abs=0.2)
    assert math.isnan(depth["mirror"])
    assert depth["glass"] > 3.5 or math.isnan(depth["glass"])


@pytest.mark.parametrize("material", ["solid", "glass", "mirror"])
def test_the_robot_collides_with_every_material(material: str) -> None:
    sim = Simulation(ROBOT, room(boxes=[pane(material, x=0.6)]))
    drive(sim, 0.4, 3.0)
    assert sim.collisions().names == ("pane",)
    assert sim.truth().pose.x < 0.6


def test_the_floor_around_a_hole_carries_as_a_plane_does() -> None:
    plain, holed = (
        Simulation(ROBOT, room(holes=holes))
        for holes in ([], [FloorHole(name="shaft", x=4.0, y=1.0, size=[1.0, 1.0], depth=0.5)])
    )
    for sim in (plain, holed):
        drive(sim, 0.3, 3.0)
    assert plain.truth().pose.distance(holed.truth().pose) < 0.02
    assert plain.collisions().episodes == holed.collisions().episodes == 0


def test_the_robot_falls_into_a_hole() -> None:
    sim = Simulation(ROBOT, room(holes=[FloorHole(name="shaft", x=1.0, y=0.0, size=[1.0, 1.5], depth=1.0)]))
    drive(sim, 0.4, 4.0)
    assert float(sim._data.qpos[2]) < -0.3


def test_a_depth_camera_sees_a_hole_deeper_than_the_floor() -> None:
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    hole = FloorHole(name="shaft", x=2.0, y=0.0, size=[1.0, 2.0], depth=0.8)
    plain, holed = (
        DepthRenderer(camera).render(Simulation(ROBOT, room(holes=holes)).capture()) for holes in ([], [hole])
    )
    deeper = holed.depth > plain.depth + 0.01
    assert deeper.any()
    assert not (holed.depth < plain.depth - 1e-6).any()
    # straight ahead and down, every deeper pixel sees the floor of the plain room between 1.5 and 2.5 m ahead
    column = camera.width // 2
    ahead = plain.depth[deeper[:, column], column]
    assert float(ahead.min()) > 1.3 and float(ahead.max()) < 2.7


def test_a_hole_is_not_a_passage() -> None:
    hole = FloorHole(name="ditch", x=3.0, y=0.0, size=[0.5, 3.9], depth=0.3)
    floor = reachable(room(holes=[hole]), ROBOT)
    assert floor.at(1.0, 0.0) == FREE
    assert floor.at(5.0, 0.0) != FREE


def test_a_place_over_a_hole_is_refused() -> None:
    with pytest.raises(UserError, match="lies inside shaft"):
        room(holes=[FloorHole(name="shaft", x=0.0, y=0.0, size=[1.0, 1.0], depth=0.5)])


def test_wheels_slip_on_a_smooth_carpet() -> None:
    smooth = Carpet(x=2.0, y=0.0, size=[8.0, 4.0], friction=0.05)
    travel = []
    for carpets in ([], [smooth]):
        sim = Simulation(ROBOT, room(carpets=carpets))
        drive(sim, 1.0, 0.5)
        travel.append(sim.truth().pose.x)
    assert travel[1] < 0.7 * travel[0]

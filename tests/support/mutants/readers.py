"""How the program reads each kind of file: the functions behind its commands, as far as a file can reach them."""

from __future__ import annotations

import tempfile
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np

from chefbot.cli.robot.foreign.urdf_given import check_given
from chefbot.config import read_bytes
from chefbot.design.export.urdf import urdf as urdf_of
from chefbot.design.sizing.robot_file_editor import Change, changed
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import read_card
from chefbot.mapping.map_format import encode_map_yaml, encode_pgm
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Twist, Vector3
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.std_msgs import String
from chefbot.proving.scenario import load_scenario
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.ros2.bag.reader import read_bag
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import QoS
from chefbot.ros2.tools.bag import info_lines
from chefbot.runtime.launch import load_launch, node_class, node_params
from chefbot.runtime.loop import Publication
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.sim.world.load import load_any_world
from chefbot.slam.carmen import parse
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.storage.carmen_log import read_text
from chefbot.storage.map_files import load_map
from chefbot.storage.mapped_drives import encode_drives, load_drives
from chefbot.storage.places import load_places, save_places
from tests.support.confined_xacro import expand_here

NOW = datetime(2026, 11, 21, tzinfo=UTC)


def pgm(grid: Grid) -> bytes:
    """The grid as a map's image."""
    return encode_pgm(grid)


def map_of(folder: Path) -> object:
    """As `chefbot launch` reads a map to localize on."""
    return load_map(folder / "map.yaml")


def bundle(grid: Grid) -> bytes:
    """A map bundle with a drive of three scans."""
    scans = [
        RecordedScan(
            float(i), np.linspace(-1.0, 1.0, 9, dtype=np.float32), np.full(9, 2.0, np.float32), pose, pose
        )
        for i, pose in enumerate((SE2(0.0, 0.0, 0.0), SE2(0.3, 0.0, 0.1), SE2(0.6, 0.0, 0.2)))
    ]
    session = Session.of(scans, [True, False, True], 8.0, None)
    image = pgm(grid)
    files = {"map.pgm": image, "map.yaml": encode_map_yaml("map.pgm", grid, image=image)}
    return encode_drives(GraphSlamParams(), [session], files)


def drives(path: Path) -> object:
    """As `chefbot map continue` and `chefbot launch` read a map bundle."""
    return load_drives(path), load_map(path)


def world(path: Path) -> object:
    """As `chefbot sim` reads a world."""
    return load_any_world(str(path), _robot())


@cache
def _robot() -> Robot:
    return load_robot("chefbot")


def robot(path: Path) -> object:
    """As `chefbot robot export urdf` reads a robot."""
    return urdf_of(load_robot(str(path)))


def calibrated(path: Path) -> object:
    """As `chefbot robot design --write` reads and rewrites a robot file."""
    load_robot(str(path))
    return changed(
        path.read_bytes().decode(), [Change(("calibration", "left_wheel"), "1.01"), Change(("name",), "x")]
    )


def launch(path: Path) -> object:
    """As `chefbot launch` reads a launch file."""
    return [node_class(entry.kind, "it") for entry in load_launch(str(path), {"speed": "2"}).nodes.values()]


def parameters(path: Path) -> object:
    """As a node reads its parameters."""
    entries = load_launch(str(path)).nodes.values()
    return [node_params(node_class(entry.kind, "it"), entry.params, "it") for entry in entries]


def scenario(path: Path) -> object:
    """As `chefbot prove` reads a scenario."""
    return load_scenario(str(path))


def places(path: Path) -> object:
    """As the web UI reads and writes the places of a map."""
    known = load_places(path)
    save_places(path, dict(list(known.items())[1:]))
    return load_places(path)


def urdf_text() -> bytes:
    """The URDF of a robot of ours."""
    return urdf_of(load_robot("chefbot")).encode()


def urdf(path: Path) -> object:
    """As `chefbot robot check-urdf` reads a URDF."""
    return check_given(path)


def xacro_file(folder: Path) -> object:
    """As `chefbot robot check-urdf` reads a xacro file, but in this process."""
    path = folder / "r.urdf.xacro"
    read_bytes(path, "robot description")
    return expand_here(path)


def carmen(folder: Path) -> object:
    """As `chefbot map slam` reads a log."""
    return [list(parse(read_text(folder / name))) for name in ("a.log", "b.log.gz")]


def relations(path: Path) -> object:
    """As `chefbot prove` reads the true relations of a log."""
    from chefbot.proving.scenario_tasks import MapLogTask
    from chefbot.proving.tasks.map_log import _relations

    return _relations(MapLogTask(log="x", relations=path.name), path.parent)


def recorded() -> tuple[bytes, dict[str, bytes]]:
    """A log of a launch, and the files of a bag."""
    with tempfile.TemporaryDirectory() as folder:
        path, bag = Path(folder, "run.mcap"), Path(folder, "bag")
        _record(path)
        _write_bag(bag)
        return path.read_bytes(), {each.name: each.read_bytes() for each in bag.iterdir()}


def _record(path: Path) -> None:
    recorder = Recorder(path, load_robot("chefbot"), 5)
    for number in range(40):
        message = Twist(linear=Vector3(x=0.1 * number), angular=Vector3())
        recorder(Publication(f"topic{number % 3}", message, "node", False, number * 10**8, False))
        if number % 20 == 0:
            recorder._file.flush()
    recorder.close()


def _write_bag(out: Path) -> None:
    writer = BagWriter(out)
    kind = InterfaceType.of(message_type("std_msgs/msg/String"))
    writer.add_topic("/words", kind, [QoS()])
    for number in range(40):
        writer.add("/words", kind, String(data=f"word {number}").to_cdr(), number * 10**8, number * 10**8)
    writer.close()


def log(folder: Path) -> object:
    """As `chefbot replay` reads a log."""
    return read_log(folder / "run.mcap")


def bag(folder: Path) -> object:
    """As `chefbot bag info` and `play` read a bag."""
    bag = read_bag(folder / "bag")
    return info_lines(bag), list(bag.messages())


def card(folder: Path) -> object:
    """As `chefbot fleet accept` and `show` read a card."""
    ring = Keyring(folder / "robot")
    ring.accept(read_card(folder / "robot1.card")[0])
    return ring.identity(), ring.card()


def keys(folder: Path) -> object:
    """As `chefbot fleet show`, `sign` and `remove` read the key folder and a request."""
    ring = Keyring(folder / "keys")
    identity = ring.identity()
    card, name = ring.admit(folder / "other" / "robot2.request", NOW, "robot")
    Keyring(folder / "other").accept(card)
    return identity, ring.remove(name)

"""No number of the robot stands a second time: outside of the robot files, code asks the Robot."""

import io
import math
import re
import tokenize
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import yaml

from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_acceleration

ROOT = Path(__file__).parents[2]
SOURCE, ROBOTS = ROOT / "src" / "chefbot", ROOT / "src" / "chefbot" / "robot"
KINDS = (".py", ".js", ".html", ".yaml", ".cpp", ".hpp", ".h", ".c", ".ino")
QUANTITY = re.compile(r"([0-9.]+(?:e-?[0-9]+)?) *([A-Za-z][A-Za-z/^0-9 ]*)?")
NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)")
SMALL = re.compile(r"(?<![\w.])(\d+\.?\d*) ?(cm|mm|g|ms|rpm|deg)\b")
SMALLER = {"cm": 0.01, "mm": 1e-3, "g": 1e-3, "ms": 1e-3, "rpm": 2 * math.pi / 60, "deg": math.pi / 180}
WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
UNTELLING = {
    "max", "min", "size", "mount", "x", "y", "z", "rate", "mass", "place", "length", "height", "width",
    "thickness", "offset", "depth", "wall", "gap", "reach", "range", "noise", "power", "friction", "time", "hole",
    "radius", "centre", "sensor", "screw", "housing", "drive", "run", "turn", "acceleration",
}  # fmt: skip
"""Words of keys that everything has: they do not tell that a number is the robot's."""
ALSO = {
    "separation": {"track", "wheelbase"},
    "diameter": {"wheel"},
    "body": {"robot", "footprint", "chassis"},
    "max_speed": {"velocity", "vel", "linear"},
    "max_turn": {"angular"},
    "ticks_per_turn": {"tick", "encoder"},
    "field_of_view": {"fov", "hfov"},
}
"""Other words under which the same number would hide."""
NOT_SIZES = re.compile(r"rgba=\"[^\"]*\"|#[0-9a-fA-F]{3,8}|[\d.]+ ?\* ?factor")
"""Colours, and millimetres on a drawing's paper, which are multiplied by its scale."""


class Home(NamedTuple):
    """A number of the spec: where it is at home, how a second copy would be written, words round it."""

    key: str
    values: tuple[float, ...]
    words: frozenset[str]
    alone: bool
    """So peculiar that it needs no word beside it to be recognized."""


def leaves(value: object, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], object]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, str(key)))
    elif not isinstance(value, list):
        yield path, value


def digits(value: float) -> int:
    """Significant ones: 0.275 has three, 0.09 one."""
    return len(f"{value:.9g}".replace(".", "").replace("-", "").strip("0").split("e")[0])


def homes() -> list[Home]:
    """The Chefbot's numbers as written and in SI, and what is computed from several of them."""
    robot = load_robot("chefbot")
    found = []
    for path, value in leaves(yaml.safe_load((ROBOTS / "chefbot.yaml").read_text())):
        match = QUANTITY.fullmatch(str(value))
        if match and match[2]:
            found.append(home(path, (float(match[1]), si(robot, path))))
    derived = {
        ("wheels", "radius"): robot.wheel_radius,
        ("motor", "ticks_per_turn"): robot.motor.ticks_per_turn,
        ("motor", "gear_ratio"): robot.motor.gear_ratio,
        ("motor", "ticks_per_turn", "whole"): float(round(robot.motor.ticks_per_turn)),
        ("motor", "ticks_per_metre"): 1.0 / robot.metres_per_tick,
        ("motor", "no_load_speed"): robot.motor.no_load_speed,
        ("motor", "stall_torque"): robot.motor.stall_torque,
        ("plates", "height"): body_height(robot),
        ("robot", "mass"): unloaded_mass(robot),
    }
    found += [home(path, (value,)) for path, value in derived.items()]
    return [one for one in found if one.values]


def si(robot: object, path: tuple[str, ...]) -> float:
    for name in path:
        robot = getattr(robot, name)
    return float(robot)  # type: ignore[arg-type]


def home(path: tuple[str, ...], values: tuple[float, ...]) -> Home:
    words = {word.rstrip("s") for name in path for word in name.split("_")} - UNTELLING
    for name in path:
        words |= ALSO.get(name, set())
    telling = tuple(value for value in values if digits(value) >= 2 or 0 < value < 0.1)
    return Home(".".join(path), telling, frozenset(words), any(digits(value) >= 4 for value in values))


def code_lines(path: Path) -> dict[int, str]:
    """Line number to code, without comments and without docstrings: prose computes nothing."""
    text = path.read_text()
    if path.suffix == ".py":
        return python_code(text)
    text = re.sub(r"/\*.*?\*/|<!--.*?-->", lambda m: "\n" * m[0].count("\n"), text, flags=re.DOTALL)
    mark = "#" if path.suffix == ".yaml" else "//"
    lines = text.split("\n")
    return {i: re.split(rf"(?:^|\s){mark}", line)[0] for i, line in enumerate(lines, start=1)}


def python_code(text: str) -> dict[int, str]:
    lines: dict[int, str] = {}
    statement = True
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        skip = token.type == tokenize.COMMENT or (token.type == tokenize.STRING and statement)
        if not skip and token.string.strip():
            lines[token.start[0]] = f"{lines.get(token.start[0], '')} {token.string}"
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            statement = token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
    return lines


def copies(path: Path, found: list[Home]) -> Iterator[str]:
    for number, code in code_lines(path).items():
        line = NOT_SIZES.sub("", code)
        written = {float(text) for text in NUMBER.findall(line)}
        if path.suffix == ".yaml":  # the only files where people write units; code is in SI
            written |= {float(text) * SMALLER[unit] for text, unit in SMALL.findall(line)}
        if not written:
            continue
        words = {word.lower().rstrip("s") for word in WORD.findall(line)}
        for one in found:
            same = [
                value for value in one.values if any(math.isclose(value, w, rel_tol=1e-6) for w in written)
            ]
            if same and (words & one.words or (one.alone and any(digits(value) >= 4 for value in same))):
                yield f"{path}:{number}: {same[0]:g} is {one.key}: {line.strip()[:90]}"


def sources() -> list[Path]:
    places = (SOURCE, ROOT / "firmware")
    return [
        path
        for place in places
        for path in sorted(place.rglob("*"))
        if path.suffix in KINDS
        and not path.is_relative_to(ROBOTS)
        and not {"build", "test", "tests", "vendor", "worlds", "node_modules"} & set(path.parts)
        and "three" not in path.name
    ]


@pytest.mark.slow
def test_no_robot_parameter_is_defined_twice() -> None:
    found = homes()
    assert len(found) > 40 and len(sources()) > 150
    assert [copy for path in sources() for copy in copies(path, found)] == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.py", "WHEEL_TRACK = 0.275\n"),
        ("a.py", "wheel_diameter: float = 0.09\n"),
        ("a.py", "x = 6533.312\n"),
        ("a.py", "max_speed = 0.35\n"),
        ("a.js", "const bodyRadius = 0.15;\n"),
        ("a.yaml", "robot_radius: 0.15\n"),
        ("a.yaml", "wheel_diameter: 9 cm  # as bought\n"),
        ("a.cpp", "constexpr float kWheelSeparation = 0.275f;\n"),
        ("a.yaml", "caster_offset: 12.5 cm\n"),
    ],
)
def test_a_second_definition_would_be_found(tmp_path, name, text) -> None:
    file = tmp_path / name
    file.write_text(text)
    assert list(copies(file, homes()))
    file.write_text({".py": "# ", ".yaml": "# "}.get(file.suffix, "// ") + text)
    assert list(copies(file, homes())) == []


# -- one number changed, and who follows


CHANGED = "like: chefbot\nname: changed\nwheels: {diameter: 10 cm}\n"
BEFORE, AFTER = 0.045, 0.05


@pytest.fixture
def robots(tmp_path):
    """The Chefbot, and the same with wheels of 10 cm."""
    (tmp_path / "changed.yaml").write_text(CHANGED)
    return load_robot("chefbot"), load_robot(str(tmp_path / "changed.yaml"))


def both(robots, figure):
    return pytest.approx([figure(robot) for robot in robots], rel=1e-9)


def test_the_wheel_diameter_is_defined_once() -> None:
    """The premise of the rest: of all files of the robot, one line says how large the wheels are."""
    text = (ROBOTS / "chefbot.yaml").read_text()
    assert sum("diameter:" in line and "9 cm" in line for line in text.split("\n")) == 1


def test_solids_follow_the_wheel_diameter(robots) -> None:
    from chefbot.robot.geometry.solids import link_origin, solids

    def radius(robot):
        wheel = next(part for part in solids(robot) if part.name == "wheel_left")
        return max(abs(corner.x) for corner in wheel.solids[0].outline.edge)

    assert both(robots, radius) == [BEFORE, AFTER]
    assert both(robots, lambda robot: link_origin(robot, "wheel_left_link")[2]) == [BEFORE, AFTER]


def test_meshes_follow_the_wheel_diameter(robots) -> None:
    pytest.importorskip("manifold3d")
    from chefbot.design.solids.triangulation import part_mesh
    from chefbot.robot.geometry.solids import solids

    def height(robot):
        wheel = next(part for part in solids(robot) if part.name == "wheel_left")
        return np.ptp(part_mesh(wheel.solids).vertices[:, 0]) / 2

    assert [height(robot) for robot in robots] == pytest.approx([BEFORE, AFTER], abs=2e-5)


def test_drawings_follow_the_wheel_diameter(robots) -> None:
    """The height of the base plate is a dimension of the assembly; it rises with the axle."""
    pytest.importorskip("ezdxf")
    from chefbot.design.drawing.drawing import Linear
    from chefbot.design.drawing.sheets import draw
    from chefbot.robot.geometry import layout

    def linears(value):
        if isinstance(value, Linear):
            yield value
        elif isinstance(value, (tuple, list)):
            for inner in value:
                yield from linears(inner)

    for robot, wheel in zip(robots, (BEFORE, AFTER), strict=True):
        ends = [one[:2] for one in linears(draw(robot, "assembly"))]
        lengths = {round(abs(b - a), 6) for start, end in ends for a, b in zip(start, end, strict=True)}
        low = 1000 * layout.plate_undersides(robot)[0]
        assert round(low, 6) in lengths
        assert low == pytest.approx(1000 * (wheel + 0.0285))


def test_urdf_follows_the_wheel_diameter(robots) -> None:
    from chefbot.design.export.urdf import urdf

    def radius(robot):
        return float(
            ET.fromstring(urdf(robot)).find("link[@name='wheel_left_link']/collision//cylinder").get("radius")
        )

    def axle(robot):
        return float(
            ET.fromstring(urdf(robot)).find("joint[@name='wheel_left_joint']/origin").get("xyz").split()[2]
        )

    assert both(robots, radius) == [BEFORE, AFTER]
    assert both(robots, axle) == [BEFORE, AFTER]


def test_sdf_follows_the_wheel_diameter(robots) -> None:
    from chefbot.design.export.sdf import sdf

    assert both(robots, lambda robot: float(ET.fromstring(sdf(robot)).find(".//wheel_radius").text)) == [
        BEFORE,
        AFTER,
    ]


def test_mjcf_follows_the_wheel_diameter(robots) -> None:
    from chefbot.design.export.mjcf import mjcf

    def tyre(robot):
        geom = ET.fromstring(mjcf(robot)).find(".//geom[@name='wheel_left']")
        return float(geom.get("size").split()[0])

    assert both(robots, tyre) == [BEFORE, AFTER]


def test_firmware_follows_the_wheel_diameter(robots) -> None:
    from chefbot.board.firmware_constants import firmware_constants

    constants = [{c.name: c.value for c in firmware_constants(robot)} for robot in robots]
    forward = [values["max_forward"] for values in constants]
    assert forward[0] / forward[1] == pytest.approx(AFTER / BEFORE, rel=1e-3)


def test_kinematics_follow_the_wheel_diameter(robots) -> None:
    from chefbot.control.kinematics import wheel_speeds
    from chefbot.odometry.drive_model import DriveModel, OdometryParams

    assert both(robots, lambda robot: wheel_speeds(0.09, 0.0, robot)[0]) == [0.09 / BEFORE, 0.09 / AFTER]
    ticks = robots[0].motor.ticks_per_turn
    rolled = [
        DriveModel.of(robot, OdometryParams()).metres_per_tick * ticks / (2 * math.pi) for robot in robots
    ]
    assert rolled == pytest.approx([BEFORE, AFTER], rel=1e-9)


def test_simulated_drive_follows_the_wheel_diameter(robots) -> None:
    """Told the same speed, both go as far, the larger wheels with fewer ticks: as the demo's robot does."""
    from chefbot.control.kinematics import wheel_speeds
    from chefbot.sim.board import SimulatedBoard
    from chefbot.sim.simulation import Simulation
    from chefbot.sim.world.world import load_world

    distances, ticks = [], []
    for robot in robots:
        sim = Simulation(robot, load_world("empty"), profile="perfect", seed=1)
        start, board = sim.truth().pose, SimulatedBoard(robot, sim)
        for step in range(1, 151):
            board.command(*wheel_speeds(0.3, 0.0, robot))
            board.run_until(step * 20_000_000)
        distances.append(sim.truth().pose.distance(start))
        ticks.append(sum(sim.wheel_ticks()) / 2)
    assert distances == [pytest.approx(0.3 * 3.0 - 0.3**2 / (2 * max_acceleration(robots[0])), rel=0.03)] * 2
    assert ticks[0] / ticks[1] == pytest.approx(AFTER / BEFORE, rel=0.01)

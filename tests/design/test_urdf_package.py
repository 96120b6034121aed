"""`chefbot_description` as a ROS 2 workspace gets it: xacro expands to our URDF, meshes are the solids."""

import ast
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from tests.design.bodies import assert_same, of_solids, of_urdf
from tests.design.fake_launch import run_launch_file

from chefbot.cli.robot.foreign.urdf_given import check_given, expanded
from chefbot.cli.robot.urdf import run_package
from chefbot.design.export.urdf import urdf
from chefbot.errors import UserError
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.geometry.shapes import volume
from chefbot.robot.geometry.solids import solids
from chefbot.robot.load import load_robot

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
NAME = "chefbot_lidar"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("workspace") / "src"
    run_package(NAME, folder)
    return folder / "chefbot_description"


def expand(package: Path, **arguments: str) -> ET.Element:
    xacro = pytest.importorskip("xacro", reason="needs xacro from PyPI")
    file = package / "urdf" / f"{NAME}.urdf.xacro"
    return ET.fromstring(xacro.process_file(str(file), mappings=arguments).toxml())


def joints(root: ET.Element) -> dict[str, list[object]]:
    """Joint to its kind, ends and numbers."""
    found: dict[str, list[object]] = {}
    for joint in root.iterfind("joint"):
        parent, child, origin = (joint.find(tag) for tag in ("parent", "child", "origin"))
        assert parent is not None and child is not None and origin is not None
        ends = [joint.attrib["type"], parent.attrib["link"], child.attrib["link"]]
        place = f"{origin.attrib['xyz']} {origin.attrib['rpy']}"
        limit = joint.find("limit")
        bounds = [] if limit is None else [float(limit.attrib["effort"]), float(limit.attrib["velocity"])]
        found[joint.attrib["name"]] = [*ends, *(float(word) for word in place.split()), *bounds]
    return found


def collisions(root: ET.Element) -> dict[str, list[float]]:
    """Collision to its numbers."""
    found = {}
    for solid in root.iterfind("link/collision"):
        (shape,) = solid.iterfind("geometry/*")
        origin = solid.find("origin")
        assert origin is not None
        place = f"{origin.attrib['xyz']} {origin.attrib['rpy']}".split()
        found[solid.attrib["name"]] = [
            float(v) for v in (*place, *(shape.attrib[key] for key in sorted(shape.attrib)))
        ]
    return found


@pytest.mark.slow
def test_xacro_expands_to_the_urdf_of_the_robot(package: Path) -> None:
    robot = load_robot(NAME)
    root, own = expand(package), ET.fromstring(urdf(robot))
    assert_same(of_urdf(ET.tostring(root, encoding="unicode")), of_solids(robot))
    for read in (joints, collisions):
        ours, theirs = read(own), read(root)
        assert set(ours) == set(theirs)
        for name, values in ours.items():
            assert theirs[name] == [
                pytest.approx(v, abs=1e-6) if isinstance(v, float) else v for v in values
            ], name
    assert {link.attrib["name"] for link in root.iterfind("link")} == {
        link.attrib["name"] for link in own.iterfind("link")
    }
    assert root.find("ros2_control") is not None
    assert root.find("gazebo") is None


def test_the_xacro_has_properties_in_place_of_the_main_numbers(package: Path) -> None:
    text = (package / "urdf" / f"{NAME}.urdf.xacro").read_text()
    for name in ("body_radius", "wheel_radius", "wheel_separation", "caster_offset", "motor_torque"):
        assert f'<xacro:property name="{name}"' in text
        assert f"${{{name}" in text, name


def test_xacro_arguments_add_gazebo_tags_and_a_prefix(package: Path) -> None:
    root = expand(package, use_gazebo="true", prefix="left/", hardware="a/B")
    names = {link.attrib["name"] for link in root.iterfind("link")}
    assert all(name.startswith("left/") for name in names)
    assert {one.attrib["reference"] for one in root.iterfind("gazebo[@reference]")} <= names
    assert {one.text for one in root.iter("gz_frame_id")} <= names
    wheels = {joint.attrib["name"] for joint in root.iterfind("joint[@type='continuous']")}
    drive = root.find("gazebo/plugin[@filename='gz-sim-diff-drive-system']")
    assert drive is not None
    assert {drive.findtext("left_joint"), drive.findtext("right_joint")} == wheels
    assert root.findtext("ros2_control/hardware/plugin") == "a/B"
    own = ET.fromstring(urdf(load_robot(NAME)))
    assert len(root.findall("gazebo")) == len(own.findall("gazebo"))


def test_every_mesh_matches_its_part_in_place(package: Path) -> None:
    from trimesh import load_mesh

    robot = load_robot(NAME)
    root = expand(package)
    visuals = {one.attrib["name"]: one for one in root.iterfind("link/visual")}
    for part in solids(robot):
        mesh = visuals[part.name].find("geometry/mesh")
        origin = visuals[part.name].find("origin")
        assert mesh is not None and origin is not None
        file = package / mesh.attrib["filename"].removeprefix("package://chefbot_description/")
        solid = load_mesh(file)
        assert solid.is_watertight, file.name
        assert solid.volume == pytest.approx(sum(volume(one) for one in part.solids), rel=2e-3), file.name
        assert [float(word) for word in origin.attrib["xyz"].split()] == pytest.approx(part.at, abs=1e-6)
        centre = part.spread.first / part.spread.volume
        at = np.array(part.at)
        if not (part.pitch or part.yaw):
            assert solid.center_mass + at == pytest.approx(centre, abs=2e-4), part.name
    used = {mesh.attrib["filename"].rpartition("/")[2] for mesh in root.iter("mesh")}
    assert used == {file.name for file in (package / "meshes").iterdir()}


def test_our_own_check_finds_all_meshes(package: Path) -> None:
    pytest.importorskip("xacro", reason="needs xacro from PyPI")
    robot = load_robot(NAME)
    tree = check_given(package / "urdf" / f"{NAME}.urdf.xacro")
    assert sum(branch.mass for branch in tree) == pytest.approx(total_mass(robot), rel=1e-6)
    (package / "meshes" / "wheel.stl").rename(package / "meshes" / "gone.stl")
    try:
        with pytest.raises(UserError, match=r"wheel\.stl does not exist"):
            check_given(package / "urdf" / f"{NAME}.urdf.xacro")
    finally:
        (package / "meshes" / "gone.stl").rename(package / "meshes" / "wheel.stl")


def test_yourdfpy_and_mujoco_load_it_with_its_meshes(package: Path, tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy", reason="needs yourdfpy from PyPI")
    pytest.importorskip("xacro", reason="needs xacro from PyPI")
    file = tmp_path / "robot.urdf"
    text = ET.tostring(expanded(package / "urdf" / f"{NAME}.urdf.xacro"), encoding="unicode")
    file.write_text(text.replace("package://chefbot_description", str(package)))
    model = yourdfpy.URDF.load(str(file))
    robot = load_robot(NAME)
    low, high = model.scene.bounds
    assert low[2] == pytest.approx(0.0, abs=1e-3)
    assert high[2] == pytest.approx(overall_height(robot), abs=1e-3)
    assert high[0] - low[0] == pytest.approx(2 * robot.body.radius, abs=2e-2)
    kept = text.replace("<compiler ", '<compiler strippath="false" ', 1)
    inside = kept.replace("package://chefbot_description", str(package))
    compiled = mujoco.MjModel.from_xml_string(inside)
    assert compiled.body_mass.sum() == pytest.approx(total_mass(robot), rel=1e-6)


def test_launch_file_finds_the_xacro_in_a_folder_with_a_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_package("desk", tmp_path / "my robots")
    home = tmp_path / "my robots" / "chefbot_description"
    entities = run_launch_file(home / "launch" / "model_robot.launch.py", home.parent, monkeypatch)
    nodes = {one.package: one for one in entities if hasattr(one, "package")}
    (parameters,) = nodes["robot_state_publisher"].parameters
    program, file, prefix = parameters["robot_description"].value.command[:3]
    assert shlex.split(program + file) == ["xacro", str(home / "urdf" / "desk.urdf.xacro")]
    assert (home / "urdf" / "desk.urdf.xacro").is_file()
    assert prefix == " prefix:="
    assert nodes["joint_state_publisher_gui"].condition.predicate_expression.variable_name == "gui"
    assert Path(nodes["rviz2"].arguments[1]).is_file()


def test_the_package_metadata_is_valid(package: Path) -> None:
    manifest = ET.parse(package / "package.xml").getroot()
    assert manifest.attrib["format"] == "3"
    assert [manifest.findtext(tag) for tag in ("name", "license", "buildtool_depend")] == [
        "chefbot_description", "Apache-2.0", "ament_cmake",
    ]  # fmt: skip
    launch = (package / "launch" / "model_robot.launch.py").read_text()
    started = {
        keyword.value.value
        for node in ast.walk(ast.parse(launch))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Node"
        for keyword in node.keywords
        if keyword.arg == "package" and isinstance(keyword.value, ast.Constant)
    }
    assert started == {"robot_state_publisher", "joint_state_publisher", "joint_state_publisher_gui", "rviz2"}
    needed = {element.text for element in manifest.iterfind("exec_depend")}
    assert started | {"xacro"} <= needed
    cmake = (package / "CMakeLists.txt").read_text()
    for folder in (path.name for path in package.iterdir() if path.is_dir()):
        assert folder in cmake
    assert (package / "urdf" / f"{NAME}.urdf.xacro").exists()
    assert yaml.safe_load((package / "config" / "robot.yaml").read_text()) == {"name": NAME}
    for config in (package / "rviz" / "robot.rviz", package / "config" / "controllers.yaml"):
        assert isinstance(yaml.safe_load(config.read_text()), dict)
    controllers = yaml.safe_load((package / "config" / "controllers.yaml").read_text())
    drive = controllers["diff_drive_controller"]["ros__parameters"]
    numbers = {name: value for name, value in drive.items() if not isinstance(value, str | list)}
    assert len(numbers) == 13
    assert {type(one) for one in numbers.values()} == {float}  # an integer would not be taken for a double

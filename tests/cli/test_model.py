"""`chefbot robot export solids`: files that can be read back, and errors of one sentence."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from tests.support.waiting import in_time

from chefbot.cli.robot.solids import Format, run_model
from chefbot.design.solids import renderer
from chefbot.errors import ChefbotError, UserError
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import StorageError

CHEFBOT = [sys.executable, "-m", "chefbot"]


MEASURED_CHEFBOT = """
import atexit, re, sys, time
def report():
    with open("/proc/self/status") as status:
        kilobytes = int(re.search(r"VmHWM:\\s+(\\d+)", status.read())[1])
    sys.stderr.write(f"{time.process_time()} {kilobytes / 1024}")
atexit.register(report)
from chefbot.cli.app import main
main()
"""
"""A cold process that reports at its end the processor seconds and megabytes that it took."""


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw small pictures in this process: they take most of the time, and have tests of their own."""
    monkeypatch.setattr(renderer, "picture", partial(renderer.picture, size=(160, 120)))


@pytest.mark.rotated("meshes of any fineness")
@pytest.mark.slow
@pytest.mark.timed
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_every_part_and_the_assembly_as_stl_in_millimetres(tmp_path: Path) -> None:
    out = tmp_path / "made" / "stl"
    done = subprocess.run(
        [sys.executable, "-c", MEASURED_CHEFBOT, "robot", "export", "solids", "--mm", "--out", str(out)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    seconds, megabytes = (float(word) for word in done.stderr.split())
    assert done.returncode == 0
    assert in_time(seconds, 5.0) and megabytes < 400.0
    files = {path.name for path in out.iterdir()}
    assert {"base_plate.stl", "wheel.stl", "caster.stl", "assembly.stl", "bom.csv", "assembly.png"} <= files
    robot = load_robot("chefbot")
    plate = trimesh.load(out / "base_plate.stl")
    assert plate.extents[2] == pytest.approx(robot.plates.thickness * 1e3, abs=1e-3)
    assert plate.is_watertight
    image = np.asarray(Image.open(out / "assembly.png"))
    assert np.std(image) > 30, "something is on it"
    assert f"{unloaded_mass(robot):.4f}" in done.stdout
    assert str(out.name) in done.stdout


@pytest.mark.parametrize("form", ["stl", pytest.param("obj", marks=pytest.mark.slow)])
def test_one_part_as_one_file(tmp_path: Path, form: Format) -> None:
    run_model("desk", form, "pole", False, tmp_path / f"one.{form}")
    mesh = trimesh.load(tmp_path / f"one.{form}", force="mesh")
    robot = load_robot("desk")
    assert sorted(mesh.extents)[2] == pytest.approx(max(robot.poles.height, 2 * robot.poles.radius), rel=1e-3)
    assert (tmp_path / "one.png").exists()
    run_model("desk", form, "stand", False, tmp_path / "folder")
    assert (tmp_path / "folder" / f"stand.{form}").exists()
    assert not (tmp_path / "folder" / f"assembly.{form}").exists()
    if form == "obj":
        library = next(line for line in (tmp_path / "one.obj").read_text().splitlines() if "mtllib" in line)
        assert (tmp_path / library.split()[1]).exists()


@pytest.mark.slow
def test_glb_of_the_robot_and_of_a_part(tmp_path: Path) -> None:
    run_model("chefbot", "glb", "all", False, tmp_path / "robot.glb")
    run_model("chefbot", "glb", "wheel", False, tmp_path / "wheel.glb")
    robot, wheel = trimesh.load(tmp_path / "robot.glb"), trimesh.load(tmp_path / "wheel.glb")
    assert "wheel_left_link" in robot.graph.nodes
    assert max(wheel.extents) == pytest.approx(load_robot("chefbot").wheels.diameter, rel=1e-3)


REFUSED: list[tuple[Format, str, bool, str, str]] = [
    ("stl", "wheal", False, "out", "wheel"),
    ("stl", "", False, "out", "no part"),
    ("glb", "all", True, "x.glb", "metres"),
    ("glb", "all", False, "x.txt", "ends in .glb"),
    ("stl", "all", False, "x.stl", "folder"),
    ("glb", "all", False, "/dev/full", "ends in .glb"),
    ("stl", "pole", False, "/dev/full", "cannot be made"),
    ("stl", "pole", False, "x" * 300, "cannot be"),
    ("glb", "pole", False, "x" * 300 + ".glb", "cannot be"),
    ("glb", "pole", False, "device.glb", "not a file"),
    ("stl", "pole", False, "file/below", "cannot be made"),
    ("glb", "pole", False, "folder.glb", "not a file"),
]


@pytest.mark.parametrize(("form", "part", "mm", "out", "expected"), REFUSED)
def test_impossible_exports_are_refused_in_one_sentence(
    tmp_path: Path, form: Format, part: str, mm: bool, out: str, expected: str
) -> None:
    (tmp_path / "file").write_text("old")
    (tmp_path / "folder.glb").mkdir()
    (tmp_path / "device.glb").symlink_to("/dev/full")
    with pytest.raises(ChefbotError, match=expected) as refusal:
        run_model("desk", form, part, mm, tmp_path / out)
    assert "\n" not in str(refusal.value)
    assert (tmp_path / "file").read_text() == "old"


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "pole.stl"
    target.write_bytes(b"old")

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(StorageError, match="No space left"):
        run_model("desk", "stl", "pole", False, target)
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.slow
def test_the_exit_code_of_bad_input_is_2() -> None:
    done = subprocess.run(
        [*CHEFBOT, "robot", "export", "solids", "--part", "wing"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(find_spec("build123d") is not None, reason="the extra is installed")
def test_step_without_the_cad_extra_names_the_package_to_install(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"pip install 'chefbot\[cad\]'"):
        run_model("desk", "step", "all", False, tmp_path / "x.step")


@pytest.mark.slow
@pytest.mark.skipif(find_spec("build123d") is None, reason="STEP needs the extra: chefbot[cad]")
def test_step_export_contains_arcs_and_names(tmp_path: Path) -> None:
    from build123d import import_step

    run_model("desk", "step", "all", False, tmp_path / "x.step")
    text = (tmp_path / "x.step").read_text()
    assert "PRODUCT('base_plate'" in text
    assert "CYLINDRICAL_SURFACE" in text
    assert "SPHERICAL_SURFACE" in text
    robot = load_robot("desk")
    from chefbot.robot.geometry.solids import solids

    read = import_step(tmp_path / "x.step")
    assert read.volume * 1e-9 == pytest.approx(sum(part.volume for part in solids(robot)), rel=1e-6)

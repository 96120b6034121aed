"""The drawings say what the robot is: read back from the DXF files, as a CAD program would."""

from __future__ import annotations

import ast
import hashlib
import itertools
import math
import os
import re
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from functools import lru_cache
from io import StringIO
from pathlib import Path

import ezdxf
import msgspec
import numpy as np
import pytest
from ezdxf import bbox
from ezdxf.document import Drawing as Document
from PIL import Image
from typer.testing import CliRunner

from chefbot.cli.app import app, main
from chefbot.cli.robot.draw import write_drawing
from chefbot.design.drawing.drawing import loop_box
from chefbot.design.drawing.dxf import LAYERS, dxf_bytes, dxf_document
from chefbot.design.drawing.paper import BINDING, MARGIN
from chefbot.design.drawing.sheets import SHEETS, draw, selected_sheets, sheets_of
from chefbot.design.drawing.views import FRONT, PLAN, SIDE, TOP, cut, seen
from chefbot.design.errors import DesignError
from chefbot.maths.outline import Outline, circle, loop_moments, rectangle
from chefbot.robot.geometry.outlines import base_plate_outline
from chefbot.robot.geometry.shapes import Prism
from chefbot.robot.geometry.solids import solids
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot

replace = msgspec.structs.replace

CHAPTER = {
    "plate radius": ("base_plate", 150.0),
    "motor, long": ("base_plate", 50.0),
    "motor, wide": ("base_plate", 40.0),
    "caster radius": ("base_plate", 15.0),
    "screw, 0.15 radius": ("base_plate", 3.0),
    "pole radius": ("base_plate", 7.0),
    "pole height": ("pole", 35.0),
    "pole diameter": ("pole", 14.0),
    "wheel section, deep": ("base_plate", 25.0),
    "wheel section, long": ("base_plate", 100.0),
    "tube length": ("tube", 150.0),
    "tube diameter": ("tube", 15.0),
    "wheel diameter": ("assembly", 90.0),
    "ground clearance": ("assembly", 30.0),
}
"""The chapter's table: sheet and millimetres."""


def with_plates(robot: Robot, count: int, notch: bool = True) -> Robot:
    """Everything that stood higher now stands on the lowest plate."""
    plates = replace(robot.plates, count=count, notch=robot.plates.notch if notch else None)
    equipment = tuple(replace(item, place=replace(item.place, plate=1)) for item in robot.equipment)
    return replace(robot, plates=plates, equipment=equipment)


def bigger(robot: Robot) -> Robot:
    """Wider plates, wheels of 150 mm, four plates."""
    return replace(
        with_plates(robot, 4),
        body=replace(robot.body, radius=0.2),
        wheels=replace(robot.wheels, diameter=0.15, separation=0.36),
        plates=replace(robot.plates, count=4, notch=replace(robot.plates.notch, length=0.17, depth=0.03)),
        poles=replace(robot.poles, reach=0.12),
    )


ROBOTS = {name: load_robot(name) for name in built_in_robots()}
CHEFBOT = ROBOTS["chefbot"]
VARIANTS = {
    **ROBOTS,
    "one plate": with_plates(CHEFBOT, 1),
    "no notches": with_plates(CHEFBOT, 2, notch=False),
    "bigger": bigger(CHEFBOT),
}
ALL_SHEETS = [
    pytest.param(name, sheet, marks=[pytest.mark.slow] if name not in ("chefbot", "bigger") else [])
    for name, robot in VARIANTS.items()
    for sheet in sheets_of(robot)
]


@lru_cache(maxsize=64)
def read_back(robot: Robot, sheet: str) -> Document:
    """What a program that opens the file gets."""
    return ezdxf.read(StringIO(dxf_bytes(dxf_document(draw(robot, sheet))).decode()))


def measurements(robot: Robot, sheet: str) -> list[float]:
    found = read_back(robot, sheet).modelspace().query("DIMENSION")
    return [round(dimension.get_measurement(), 6) for dimension in found]


def plate_polyline(robot: Robot, sheet: str = "base_plate") -> list[tuple[float, float, float]]:
    lines = read_back(robot, sheet).modelspace().query('LWPOLYLINE[layer=="OUTLINE"]')
    curved = [line for line in lines if any(bulge for *_, bulge in line.get_points("xyb"))]
    edges = curved if robot.body.radius is not None else list(lines)
    return max((line.get_points("xyb") for line in edges), key=len)


def screw_circles(robot: Robot, sheet: str) -> list[float]:
    circles = read_back(robot, sheet).modelspace().query('CIRCLE[layer=="HOLES"]')
    return [circle.dxf.radius for circle in circles]


def area_of(corners: list[tuple[float, float, float]]) -> float:
    """Shoelace, and the segment under every arc: r^2 (turn - sin turn) / 2."""
    total = 0.0
    for (ax, ay, bulge), (bx, by, _) in zip(corners, corners[1:] + corners[:1], strict=True):
        total += (ax * by - bx * ay) / 2
        if bulge:
            turn = 4 * math.atan(bulge)
            radius = math.hypot(bx - ax, by - ay) / 2 / math.sin(turn / 2)
            total += radius**2 * (turn - math.sin(turn)) / 2
    return total


@pytest.mark.rotated("drawings of any robot")
@pytest.mark.parametrize(("name", "sheet"), ALL_SHEETS)
def test_every_dxf_is_valid_and_in_millimetres(name: str, sheet: str) -> None:
    document = read_back(VARIANTS[name], sheet)
    auditor = document.audit()
    assert not auditor.errors
    assert not auditor.fixes
    assert (document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == (4, 1)
    used = {entity.dxf.layer for entity in document.modelspace()}
    assert {"OUTLINE", "DIMENSION", "TITLE"} <= used <= set(LAYERS)
    dimensions = document.modelspace().query("DIMENSION")
    assert len(dimensions) >= 2
    assert all(
        len(list(dimension.virtual_entities())) > 3 for dimension in dimensions
    )  # drawn, not only meant


@pytest.mark.parametrize(("name", "sheet"), ALL_SHEETS)
def test_librecad_prints_to_scale_with_legible_dimensions(name: str, sheet: str) -> None:
    """It looks for paper, scale and the look of dimensions in the header, and writes no R and no Ø of its own."""
    document, drawing = read_back(VARIANTS[name], sheet), draw(VARIANTS[name], sheet)
    header, style = document.header, document.dimstyles.get("CHEFBOT")
    assert (*header["$PLIMMIN"], *header["$PLIMMAX"]) == (0.0, 0.0, *drawing.paper)
    assert header["$PSVPSCALE"] * drawing.scale.factor == pytest.approx(1.0)
    for key in ("dimtxt", "dimasz", "dimexo", "dimexe", "dimgap", "dimscale", "dimdsep"):
        assert header[f"${key.upper()}"] == style.dxf.get(key), key
    assert header["$DIMTXT"] * header["$DIMSCALE"] == 2.5 * drawing.scale.factor
    for one in document.modelspace().query("DIMENSION"):
        if one.dimtype in (3, 4):
            assert ("Ø" if one.dimtype == 3 else "R") in one.dxf.text


LIBRECAD = shutil.which("librecad")
POINTS = 72 / 25.4
"""Of a PDF in a millimetre."""


@pytest.mark.slow
@pytest.mark.skipif(LIBRECAD is None, reason="needs LibreCAD: apt-get install librecad")
@pytest.mark.parametrize("sheet", ["base_plate", "tube", "assembly"])
def test_librecad_opens_it_and_fills_the_paper(sheet: str, tmp_path: Path) -> None:
    """The frame in its print reaches the margins: it was printed to scale, nothing fits itself."""
    drawing, file = draw(CHEFBOT, sheet), tmp_path / f"{sheet}.dxf"
    file.write_bytes(dxf_bytes(dxf_document(drawing)))
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(tmp_path)}
    subprocess.run([str(LIBRECAD), "dxf2pdf", str(file)], env=environment, capture_output=True, check=True)
    text = file.with_suffix(".pdf").read_bytes()
    media = re.search(rb"/MediaBox \[0 0 (\S+) (\S+)\]", text)
    assert media is not None
    assert [float(side) for side in media.groups()] == pytest.approx(
        [side * POINTS for side in drawing.paper], abs=1.0
    )
    lines = printed_lines(text)
    width, height = drawing.paper
    assert np.ptp(lines, axis=0) / POINTS == pytest.approx(
        [width - BINDING - MARGIN, height - 2 * MARGIN], abs=1.0
    )


def printed_lines(pdf: bytes) -> np.ndarray:
    """Ends of all lines of a PDF that Qt wrote, (n, 2) in points; it scales once, at the beginning."""
    (page,) = [
        zlib.decompress(stream)
        for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, flags=re.DOTALL)
        if stream[:1] == b"x" and b" l\n" in zlib.decompress(stream)
    ][:1]
    scale = float(re.search(rb"([\d.]+) 0 0 -?[\d.]+ \S+ \S+ cm", page)[1])  # type: ignore[index]
    drawn = page.rpartition(b"W* n")[2]  # behind the path that clips to the page
    return scale * np.array([[float(x), float(y)] for x, y in re.findall(rb"(\S+) (\S+) [ml]\b", drawn)])


@pytest.mark.parametrize("what", CHAPTER)
def test_every_size_of_the_chapter_is_a_dimension(what: str) -> None:
    sheet, millimetres = CHAPTER[what]
    assert millimetres in measurements(CHEFBOT, sheet)


@pytest.mark.rotated("drawings of any robot")
@pytest.mark.parametrize(("name", "sheet"), ALL_SHEETS)
def test_dimensions_print_the_measured_length(name: str, sheet: str) -> None:
    for dimension in read_back(VARIANTS[name], sheet).modelspace().query("DIMENSION"):
        texts = [e for e in dimension.virtual_entities() if e.dxftype() in ("TEXT", "MTEXT")]
        value = f"{dimension.get_measurement():.2f}".rstrip("0").rstrip(".")
        (text,) = texts
        assert text.plain_text().strip().lstrip("0123456789× minRØ.") == ""
        assert text.plain_text().endswith(value)


@pytest.mark.parametrize("name", VARIANTS)
def test_plate_drawing_has_holes_and_notches(name: str) -> None:
    robot = VARIANTS[name]
    holes = screw_circles(robot, "base_plate")
    poles = 4 if robot.plates.count > 1 else 0
    assert holes.count(pytest.approx(robot.plates.screw_hole * 500)) == poles + 4 + 2 * 4
    assert holes.count(pytest.approx(robot.plates.centre_hole * 500)) == 1
    assert len(holes) == 13 + poles
    if robot.plates.notch:
        corners = plate_polyline(robot)
        straight = 0 if robot.body.radius is not None else 6  # beside the notches, of a rectangle
        assert sum(bulge == 0.0 for *_, bulge in corners) == 2 * 3 + straight  # a notch has three sides
        assert sum(bulge != 0.0 for *_, bulge in corners) == (0 if straight else 2)
    else:
        circles = read_back(robot, "base_plate").modelspace().query('CIRCLE[layer=="OUTLINE"]')
        assert robot.body.radius * 1000 in [circle.dxf.radius for circle in circles]


@pytest.mark.parametrize("name", [name for name, robot in VARIANTS.items() if robot.plates.notch])
def test_the_drawn_plate_has_the_exact_area(name: str) -> None:
    robot = VARIANTS[name]
    holes = sum(math.pi * radius**2 for radius in screw_circles(robot, "base_plate"))
    area = area_of(plate_polyline(robot)) - holes
    assert area == pytest.approx(base_plate_outline(robot).moments().area * 1e6, rel=1e-9)


@pytest.mark.slow
def test_the_drawing_follows_the_robot() -> None:
    wheels = replace(CHEFBOT, wheels=replace(CHEFBOT.wheels, diameter=0.11))
    assert 110.0 in measurements(wheels, "assembly")
    assert 90.0 not in measurements(wheels, "assembly")
    body = replace(CHEFBOT, body=replace(CHEFBOT.body, radius=0.1625))
    assert 162.5 in measurements(body, "base_plate")
    assert 162.5 in measurements(body, "top_plate")
    assert 150.0 not in measurements(body, "base_plate")
    assert area_of(plate_polyline(body)) > area_of(plate_polyline(CHEFBOT))


def texts_of(document: Document) -> Iterator[tuple[str, bbox.BoundingBox]]:
    """All letters of a sheet with the box around them."""
    space = document.modelspace()
    inside = itertools.chain.from_iterable(d.virtual_entities() for d in space.query("DIMENSION"))
    for entity in itertools.chain(space.query("TEXT"), inside):
        if entity.dxftype() in ("TEXT", "MTEXT"):
            yield entity.plain_text(), bbox.extents([entity])


@pytest.mark.rotated("drawings of any robot")
@pytest.mark.parametrize(("name", "sheet"), ALL_SHEETS)
def test_texts_do_not_overlap_and_stay_on_the_paper(name: str, sheet: str) -> None:
    robot = VARIANTS[name]
    boxes = list(texts_of(read_back(robot, sheet)))
    for (a, first), (b, second) in itertools.combinations(boxes, 2):
        assert not first.has_overlap(second), f"{a!r} and {b!r}"
    drawing = draw(robot, sheet)
    factor, (width, height) = drawing.scale.factor, drawing.size
    extents = bbox.extents(read_back(robot, sheet).modelspace())
    assert extents.extmin.isclose((BINDING * factor, MARGIN * factor))
    assert extents.extmax.isclose((width - MARGIN * factor, height - MARGIN * factor))


@pytest.mark.slow
def test_the_same_robot_gives_identical_bytes() -> None:
    program = (
        "import hashlib; from chefbot.robot.load import load_robot; from chefbot.design.drawing.sheets import *;"
        "from chefbot.design.drawing.dxf import *; robot = load_robot('chefbot');"
        "print({s: hashlib.sha256(dxf_bytes(dxf_document(draw(robot, s)))).hexdigest() for s in SHEETS})"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("0", "4")  # with these two, a set of ezdxf has another order
    ]
    files = {sheet: dxf_bytes(dxf_document(draw(CHEFBOT, sheet))) for sheet in SHEETS}
    assert outputs[0] == outputs[1]
    assert ast.literal_eval(outputs[0]) == {s: hashlib.sha256(file).hexdigest() for s, file in files.items()}
    assert ezdxf.options.write_fixed_meta_data_for_testing is False


@pytest.mark.slow
def test_pictures_show_the_paper_in_white(tmp_path: Path) -> None:
    drawing = draw(CHEFBOT, "pole")
    files = write_drawing(drawing, tmp_path)
    before = [file.read_bytes() for file in files]
    assert [file.read_bytes() for file in write_drawing(drawing, tmp_path)] == before
    with Image.open(tmp_path / "pole.png") as image:
        width, height = image.size
        assert width / height == pytest.approx(297 / 210, rel=1e-3)
        colours = {colour: count for count, colour in image.convert("RGB").getcolors(1 << 24)}
    assert 0.9 < colours[255, 255, 255] / (width * height) < 0.999
    assert before[2].startswith(b"%PDF")


def test_views_keep_sizes_and_handedness() -> None:
    """A bracket that is its own mirror image in no direction."""
    outline = Outline(rectangle(0.02, 0.01, 0.03, 0.0), (circle(0.002, 0.035, 0.001),))
    prism = Prism(outline, 0.006, "x", (0.1, 0.0, 0.0))
    front = seen(prism, FRONT)  # outline in (y, z)
    assert loop_box(front.edge) == pytest.approx((20.0, -5.0, 40.0, 5.0))
    assert loop_box(front.holes[0]).middle == pytest.approx((35.0, 1.0))
    assert loop_box(seen(prism, PLAN).edge) == pytest.approx((-40.0, 97.0, -20.0, 103.0))
    assert loop_box(seen(prism, TOP).edge) == pytest.approx((20.0, -103.0, 40.0, -97.0))
    side = seen(prism, SIDE)
    assert loop_box(side.edge) == pytest.approx((97.0, -5.0, 103.0, 5.0))
    assert loop_box(side.hidden[0]) == pytest.approx((97.0, -1.0, 103.0, 3.0))
    for shape in (front, side, seen(prism._replace(axis="y"), FRONT), seen(prism._replace(axis="y"), SIDE)):
        assert loop_moments(shape.edge).area > 0.0


def test_a_view_from_behind_mirrors_arcs() -> None:
    half = Outline(base_plate_outline(CHEFBOT).edge)
    back = seen(Prism(half, 0.005), PLAN._replace(right=(0.0, 1.0, 0.0)))
    assert loop_moments(back.edge).area == pytest.approx(half.moments().area * 1e6, rel=1e-12)


def test_a_section_cuts_material_only() -> None:
    ring = Outline(circle(0.01), (circle(0.004),))
    np.testing.assert_allclose(cut(ring), [(-0.01, -0.004), (0.004, 0.01)])
    square = Outline(rectangle(0.02, 0.02), (circle(0.002, 0.005),))
    np.testing.assert_allclose(cut(square), [(-0.01, 0.003), (0.007, 0.01)])


def test_robots_have_the_sheets_of_their_parts() -> None:
    assert sheets_of(CHEFBOT) == list(SHEETS)
    single = VARIANTS["one plate"]
    assert sheets_of(single) == ["base_plate", "motor_clamp", "caster", "assembly"]
    with pytest.raises(DesignError, match="chefbot has no tube; its sheets are base_plate, motor_clamp"):
        selected_sheets(single, ["tube"])
    assert selected_sheets(single, ["all", "caster"]) == sheets_of(single)


def test_the_parts_list_names_every_part() -> None:
    texts = [text for text, _ in texts_of(read_back(CHEFBOT, "assembly"))]
    for kind in {part.kind for part in solids(CHEFBOT)}:
        assert kind.replace("_", " ") in texts


@pytest.mark.slow
def test_draw_writes_three_files_per_sheet(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["robot", "draw", "tube", "pole", "--out", str(tmp_path / "new" / "folder")]
    )
    assert done.exit_code == 0, done.output
    names = {f"{sheet}.{kind}" for sheet in ("tube", "pole") for kind in ("dxf", "png", "pdf")}
    assert {path.name for path in (tmp_path / "new" / "folder").iterdir()} == names


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["base_plat"], "did you mean 'base_plate'?"),
        (["pole", "--robot", "chefbott"], "no robot is called 'chefbott'"),
        (["pole", "--out", "FILE/in"], "cannot be made"),
        (["pole", "--out", "FILE"], "cannot be made"),
        (["pole", "--out", "/proc/nothing"], "cannot be made"),
    ],
)
def test_bad_input_is_reported_in_one_sentence(
    arguments: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file").touch()
    given = [argument.replace("FILE", str(tmp_path / "file")) for argument in arguments]
    monkeypatch.setattr(sys, "argv", ["chefbot", "robot", "draw", *given])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1

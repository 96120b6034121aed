"""Pictures of a robot: drawings true to scale, and the view from above with overlaps in red."""

from __future__ import annotations

import io
import random
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PIL import Image

from chefbot.cli.robot.check_picture import OVERLAP, write_picture
from chefbot.cli.robot.draw_picture import DOTS_PER_INCH, INCH, picture
from chefbot.design.drawing.dxf import dxf_document
from chefbot.design.drawing.paper import Drawing
from chefbot.design.drawing.sheets import draw
from chefbot.errors import UserError
from chefbot.robot.geometry import layout
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import StorageError

CHEFBOT = load_robot("chefbot")


@pytest.fixture(scope="module")
def pole() -> Drawing:
    """The smallest sheet."""
    return draw(CHEFBOT, "pole")


def test_a_drawing_has_the_size_of_its_paper(pole: Drawing) -> None:
    width, height = pole.paper
    with Image.open(io.BytesIO(picture(dxf_document(pole), pole, "png"))) as image:
        assert image.size == pytest.approx(
            (width / INCH * DOTS_PER_INCH, height / INCH * DOTS_PER_INCH), abs=1.0
        )
        assert image.convert("L").getextrema()[1] == 255, "the paper is white"
        assert np.mean(np.asarray(image.convert("L")) < 128) > 0.001, "there are lines on it"
    box = re.search(rb"/MediaBox \[ *([\d. ]+)\]", picture(dxf_document(pole), pole, "pdf"))
    assert box is not None
    points = [float(number) for number in box[1].split()]
    assert points == pytest.approx([0.0, 0.0, width / INCH * 72.0, height / INCH * 72.0], abs=0.01)


def test_a_drawing_is_the_same_again_and_leaves_chance_alone(pole: Drawing) -> None:
    random.seed(5)
    before = random.getstate()
    first = picture(dxf_document(pole), pole, "pdf")
    assert random.getstate() == before
    random.seed(6)
    assert picture(dxf_document(pole), pole, "pdf") == first


def red_pixels(data: bytes) -> int:
    """Pixels of the colour of overlaps, which is nearly opaque."""
    with Image.open(io.BytesIO(data)) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    red = 255.0 * np.array(OVERLAP[:3])
    return int((np.abs(pixels - red).max(axis=2) < 40).sum())


@pytest.mark.slow
def test_overlaps_are_red_and_only_they(tmp_path: Path) -> None:
    one, *others = CHEFBOT.equipment
    twice = msgspec.structs.replace(
        CHEFBOT, equipment=(one, msgspec.structs.replace(one, name="again"), *others)
    )
    write_picture(CHEFBOT, tmp_path / "new" / "robot.png")
    write_picture(twice, tmp_path / "new" / "twice.png")
    good, bad = ((tmp_path / "new" / f"{name}.png").read_bytes() for name in ("robot", "twice"))
    assert red_pixels(good) == 0
    assert red_pixels(bad) > 100
    with Image.open(io.BytesIO(good)) as image:  # the parts between two plates share a view
        assert image.size == (500 * (1 + len(layout.plate_undersides(CHEFBOT))), 540)


@pytest.mark.parametrize("name", ["robot.jpg", "robot", ".png", "robot.png.gz"])
def test_a_picture_of_another_kind_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"give a name that ends in \.png"):
        write_picture(CHEFBOT, tmp_path / "other" / name)
    assert not (tmp_path / "other").exists()


def test_a_folder_that_cannot_be_made_has_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StorageError):
        write_picture(CHEFBOT, tmp_path / "file" / "x.png")

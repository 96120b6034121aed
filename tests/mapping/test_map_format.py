"""Tests encoding and decoding of maps in the format of ROS, and the errors for corrupt files."""

import io
import math
import struct
import time
import tracemalloc
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from chefbot.mapping.image_format import MapFormatError, decode_image
from chefbot.mapping.map_format import (
    decode_map,
    decode_map_yaml,
    encode_map_yaml,
    encode_pgm,
)
from chefbot.maths.grid import Grid

YAML = b"""image: a.pgm
resolution: 0.050000
origin: [-10.000000, 5e-1, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def decode(image, extra=b"", yaml=YAML):
    return decode_map(decode_map_yaml(yaml + extra, "map.yaml"), image, "a.pgm")


def pgm(pixels, white=255):
    rows = np.atleast_2d(np.asarray(pixels))
    kind = ">u2" if white > 255 else "u1"
    return b"P5 %d %d %d\n" % (rows.shape[1], rows.shape[0], white) + rows.astype(kind).tobytes()


def png(pixels, mode):
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8), mode).save(file, "PNG")
    return file.getvalue()


def values(grid):
    return grid.cells.tolist()


def grids(cells):
    number = st.floats(-1e5, 1e5)
    shapes = hnp.array_shapes(min_dims=2, max_dims=2, max_side=9)
    return st.builds(Grid, hnp.arrays(np.int8, shapes, elements=cells), st.floats(1e-4, 10), number, number)


def encode_and_decode(grid, mode):
    image = encode_pgm(grid, mode)
    yaml = encode_map_yaml("it's: a #map.pgm", grid, mode, image)
    metadata = decode_map_yaml(yaml, "map.yaml")
    assert metadata.image == "it's: a #map.pgm"
    return decode_map(metadata, image, "picture")


@pytest.mark.parametrize(
    ("mode", "cells"), [("trinary", st.sampled_from([-1, 0, 100])), ("raw", st.integers(-1, 100))]
)
@given(data=st.data())
def test_a_written_map_reads_back_exactly(mode, cells, data):
    grid = data.draw(grids(cells))
    again = encode_and_decode(grid, mode)
    assert np.array_equal(again.cells, grid.cells) and again.cells.dtype == np.int8
    assert (again.resolution, again.origin_x, again.origin_y) == (
        grid.resolution,
        grid.origin_x,
        grid.origin_y,
    )


def test_trinary_mode_converts_as_map_saver_does():
    grid = Grid(np.arange(-1, 101, dtype=np.int8)[None], 0.05, 0.0, 0.0)
    row = encode_and_decode(grid, "trinary").cells[0]
    assert [int(np.sum(row == value)) for value in (0, -1, 100)] == [20, 1 + 46, 35]
    assert row[1] == 0 and row[20] == 0 and row[21] == -1 and row[66] == -1 and row[67] == 100


def test_a_small_map_has_the_expected_bytes():
    grid = Grid(np.array([[0, 100], [-1, 0]], np.int8), 0.05, 0.0, 0.0)
    assert encode_pgm(grid) == b"P5\n2 2\n255\n" + bytes([205, 254, 254, 0])


def test_the_top_row_of_the_image_is_the_highest_y():
    grid = decode(pgm([[0, 254], [254, 254]]))
    assert values(grid) == [[0, 0], [100, 0]]
    assert grid.at(-10.0 + 0.01, 0.5 + 0.06) == 100
    assert (grid.resolution, grid.origin_x, grid.origin_y) == (0.05, -10.0, 0.5)


def test_thresholds_are_exact():
    """p = (255 - x) / 255 must be above 0.65 or below 0.196: 89 is 0.651, 90 is 0.647, 205 is 0.19608."""
    assert values(decode(pgm([0, 89, 90, 205, 206, 255]))) == [[100, 100, -1, -1, 0, 0]]


@pytest.mark.parametrize("white", [255, 65535])
def test_map_savers_grey_is_unknown_whatever_the_threshold(white):
    """With the free_thresh that Nav2's map_saver writes, its own grey would be free."""
    yaml, scale = YAML.replace(b"0.196", b"0.25"), white // 255
    row = [level * scale for level in (0, 204, 205, 206, 254)]
    assert values(decode(pgm(row, white), yaml=yaml)) == [[100, 0, -1, 0, 0]]
    # of other tools' images, without map_saver's white, the threshold decides
    assert values(decode(pgm([205 * scale, white], white), yaml=yaml)) == [[0, 0]]
    assert values(decode(pgm([205, 254]), b"mode: scale\n", yaml=yaml)) == [[0, 0]]


def test_negate_inverts_the_image():
    yaml = YAML.replace(b"negate: 0", b"negate: 1")
    assert values(decode(pgm([0, 49, 50, 165, 166, 255]), yaml=yaml)) == [[0, 0, -1, -1, 100, 100]]
    assert values(decode(pgm([255]), yaml=YAML.replace(b"negate: 0", b"negate: true"))) == [[100]]


def test_scale_mode_interpolates_between_thresholds():
    p = (255 - 150) / 255
    between = round(100 * (p - 0.196) / (0.65 - 0.196))
    assert between == 48, "map_server of ROS 1 has 47 here, nav2_map_server 48"
    assert values(decode(pgm([0, 150, 255]), b"mode: scale\n")) == [[100, between, 0]]
    clear = png([[[0, 255], [0, 254], [255, 255]]], "LA")
    assert values(decode(clear, b"mode: scale\n")) == [[100, -1, 0]]


def test_raw_mode_ignores_negate_and_values_beyond_100():
    yaml = YAML.replace(b"negate: 0", b"negate: 1") + b"mode: raw\n"
    assert values(decode(pgm([0, 1, 100, 101, 255]), yaml=yaml)) == [[0, 1, 100, -1, -1]]


def test_colours_are_averaged_and_alpha_counts_in_trinary():
    assert values(decode(png([[[0, 0, 255], [0, 0, 0], [255, 255, 100]]], "RGB"))) == [[100, 100, -1]]
    assert values(decode(png([[[255] * 4, [255, 255, 255, 0], [0, 0, 0, 255]]], "RGBA"))) == [[0, -1, 100]]


@pytest.mark.parametrize("mode", ["1", "L", "P", "LA", "RGBA"])
def test_png_of_any_colour_type_is_read(mode):
    file = io.BytesIO()
    Image.fromarray(np.array([[0, 255]], np.uint8)).convert(mode).save(file, "PNG")
    assert values(decode(file.getvalue())) == [[100, 0]]


def test_png_with_16_bits_is_read():
    file = io.BytesIO()
    Image.fromarray(np.array([[0, 128 * 257, 65535]], np.uint16)).save(file, "PNG")
    assert values(decode(file.getvalue())) == [[100, -1, 0]]


@pytest.mark.parametrize(
    "image",
    [
        b"P5\n# CREATOR: map_saver 0.050 m/pix\n2 1\n255\n\x00\xfe",
        b"P5 2\n#a\n#b\r\n1 #white:\n255\n\x00\xfe",
        b"P2\n# text\n2 1\n255\n0 # black\n254\n",
        b"P2 2 1 65535 0\t65000",
        b"P5 2 1 65535\n\x00\x00\xfe\xfe",
        b"P5 2 1 1\n\x00\x01",
        b"P5 2 1 255\n\x00\xfe and more",
    ],
)
def test_pgm_variants_of_common_tools_are_read(image):
    assert values(decode(image)) == [[100, 0]]


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (b"", "neither"),
        (b"P6 1 1 255\n123", "neither"),
        (b"GIF89a", "neither"),
        (b"P5", "header"),
        (b"P5 1 1 255", "header"),
        (b"P5 -1 1 255\n0", "header"),
        (b"P5 1e3 1 255\n0", "header"),
        (b"P5 99999999999999999999 1 255\n0", "header"),
        (b"P5 1000000000 1000000000 255\n0", "is the maximum"),
        (b"P2 1000000000 1000000000 255\n0", "is the maximum"),
        (b"P5 100000 10000 255\n0", "is the maximum"),
        (b"P5 10000 10000 255\n0", "truncated"),
        (b"P5 0 5 255\n", "at least one"),
        (b"P5 1 1 0\n0", "white"),
        (b"P5 1 1 65536\n00", "white"),
        (b"P5 1 1 10\n\xff", "above"),
        (b"P2 1 1 255\n", "truncated"),
        (b"P2 2 1 255\n7 ", "truncated"),
        (b"P2 1 1 255\n-7", "other than numbers"),
        (b"P2 1 1 255\n7.5", "other than numbers"),
        (b"P2 1 1 255\n" + 100 * b"9", "above"),
        (png([[0]], "L")[:20], "header"),
        (png([[0]], "L")[:40], "PNG"),
        (png(np.arange(90).reshape(9, 10), "L")[:-30], "PNG"),
        (b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 2**31 - 1, 2**31 - 1), "is the maximum"),
        (b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 0, 1), "at least one"),
    ],
)
def test_a_corrupt_image_is_reported_in_one_sentence(image, reason):
    with pytest.raises(MapFormatError, match=reason) as caught:
        decode(image)
    assert str(caught.value).startswith("a.pgm")


def png_bomb(width, height):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(bytes(1_000_000))) + chunk(b"IEND", b"")
    )


def test_implausible_image_sizes_take_no_memory_or_time():
    tracemalloc.start()
    began = time.process_time()
    for image in (
        b"P5 1000000000 1000000000 255\n0",
        b"P5 9999 9999 255\n0",
        png_bomb(20_000, 20_000),
        b"P2 9999 9999 255\n" + b"1 " * 1000,
    ):
        with pytest.raises(MapFormatError):
            decode(image)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5_000_000
    assert time.process_time() - began < 5.0, "processor time, not wall time"


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (b"resolution: 0.050000", b"resolution: .nan", "resolution"),
        (b"resolution: 0.050000", b"resolution: 0", "resolution"),
        (b"resolution: 0.050000", b"resolution: -0.05", "resolution"),
        (b"resolution: 0.050000", b"resolution: " + 400 * b"9", "resolution"),
        (b"resolution: 0.050000", b"resolution: true", "resolution"),
        (b"resolution: 0.050000", b"resolution: [1]", "resolution"),
        (b"resolution", b"resolutoin", "did you mean 'resolution'"),
        (b"negate: 0", b"negate: 2", "negate"),
        (b"negate: 0", b"negate: [0]", "negate"),
        (b"negate: 0\n", b"", "'negate' is missing"),
        (b"[-10.000000, 5e-1, 0.0]", b"[1, 2]", "origin"),
        (b"[-10.000000, 5e-1, 0.0]", b"[1, 2, .inf]", "origin"),
        (b"[-10.000000, 5e-1, 0.0]", b"[1, 2, x]", "origin"),
        (b"[-10.000000, 5e-1, 0.0]", b"zero", "origin"),
        (b"image: a.pgm", b"image: ''", "image"),
        (b"image: a.pgm", b'image: "a\\0.pgm"', "image"),
        (b"image: a.pgm", b"image: 5", "image"),
        (b"occupied_thresh: 0.65", b"occupied_thresh: 1.5", "occupied_thresh"),
        (b"occupied_thresh: 0.65", b"occupied_thresh: 0.1", "below"),
        (b"free_thresh: 0.196", b"free_thresh: -1", "free_thresh"),
        (b"free_thresh: 0.196", b"free_thresh: 0.196\nmode: trinery", "did you mean 'trinary'"),
        (b"free_thresh: 0.196", b"free_thresh: 0.196\nmode: [raw]", "mode"),
        (b"free_thresh: 0.196", b"free_thresh: 0.65\nmode: scale", "below"),
        (YAML, b"", "keys"),
        (YAML, b"- 1\n", "keys"),
        (YAML, b"\xff\xfe", "UTF-8"),
        (YAML, b"a: [", "line"),
    ],
)
def test_an_invalid_yaml_file_is_reported_in_one_sentence(old, new, reason):
    assert old in YAML
    with pytest.raises(MapFormatError, match=reason) as caught:
        decode(pgm([0]), yaml=YAML.replace(old, new))
    assert str(caught.value).startswith("map.yaml")


def test_a_yaml_file_with_the_image_of_another_map_is_rejected():
    grid = Grid(np.zeros((3, 3), np.int8), 0.05, 0.0, 0.0)
    yaml = encode_map_yaml("a.pgm", grid, image=encode_pgm(grid))
    with pytest.raises(MapFormatError, match="image sha256"):
        decode(pgm(np.zeros((3, 3))), yaml=yaml)
    by_hand = b"\n".join(line for line in yaml.splitlines() if b"sha256" not in line)
    assert values(decode(pgm(np.zeros((3, 3))), yaml=by_hand)) == [[100] * 3] * 3


def test_keys_that_other_tools_add_are_ignored():
    yaml = YAML + b"frame_id: map\nwidth: 3\ncost_translation_table: [0, 100]\n1: 2\n"
    assert values(decode(pgm([0, 255]), yaml=yaml)) == [[100, 0]]
    with pytest.raises(MapFormatError, match="did you mean 'mode'"):
        decode(pgm([0, 255]), yaml=YAML + b"mod: raw\n")


def test_a_transparent_level_of_a_16_bit_png_is_read():
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 3, 1, 16, 0, 0, 0, 0)) + chunk(b"tRNS", b"\xff\xff")
    pixels = zlib.compress(b"\0" + struct.pack(">HHH", 0, 65000, 65535))
    image = b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    assert values(decode(image, b"mode: scale\n")) == [[100, 0, -1]]


@pytest.mark.parametrize("quarter", range(-2, 5))
def test_a_quarter_turn_is_exact(quarter):
    rng = np.random.default_rng(0)
    pixels = rng.choice(np.array([0, 205, 254]), size=(4, 7))
    plain = decode(pgm(pixels))
    yaw = quarter * math.pi / 2
    turned = decode(pgm(pixels), yaml=YAML.replace(b", 0.0]", f", {yaw!r}]".encode()))
    assert np.array_equal(
        turned.cells, np.rot90(plain.cells, -quarter)
    )  # the first row is the lowest, which reverses the sense
    assert turned.resolution == plain.resolution


@given(st.floats(-4, 4), st.integers(0, 3), st.integers(0, 6))
def test_a_rotated_cell_is_at_its_rotated_position(yaw, row, column):
    pixels = np.full((4, 7), 254)
    pixels[row, column] = 0
    grid = decode(pgm(pixels), yaml=YAML.replace(b", 0.0]", f", {yaw!r}]".encode()))
    across, up = (column + 0.5) * 0.05, (3 - row + 0.5) * 0.05
    x = -10.0 + across * math.cos(yaw) - up * math.sin(yaw)
    y = 0.5 + across * math.sin(yaw) + up * math.cos(yaw)
    found = {
        grid.at(x + dx, y + dy) for dx in (-1e-9, 1e-9) for dy in (-1e-9, 1e-9)
    }  # on an edge either cell is correct
    assert 100 in found
    assert set(np.unique(grid.cells)) <= {-1, 0, 100}
    assert (grid.cells == 100).sum() <= 4


def test_rotation_of_a_strip_is_bounded_in_size():
    yaml = YAML.replace(b", 0.0]", b", 0.7]")
    with pytest.raises(MapFormatError, match="turned by"):
        decode(b"P5 1 1000000 255\n" + bytes(1_000_000), yaml=yaml)


def mutations(original):
    """Return a strategy for the bytes with some replaced, removed or inserted."""
    place = st.integers(0, len(original) - 1)
    edit = st.tuples(place, st.integers(0, 8), st.binary(max_size=8))
    return st.lists(edit, max_size=4).map(lambda edits: _mutate(original, edits))


def _mutate(data, edits):
    for place, length, new in edits:
        data = data[:place] + new + data[place + length :]
    return data


IMAGES = [
    pgm(np.arange(12).reshape(3, 4)),
    b"P2\n# text\n3 2\n255\n0 1 2\n3 4 5\n",
    png(np.arange(12).reshape(3, 4), "L"),
    png(np.arange(48).reshape(3, 4, 4), "RGBA"),
]


@settings(max_examples=300)
@given(st.sampled_from(IMAGES).flatmap(mutations), mutations(YAML))
@pytest.mark.slow
def test_corrupt_files_give_a_map_or_one_sentence(image, yaml):
    for some_yaml in (YAML, yaml):
        try:
            grid = decode(image, yaml=some_yaml)
        except MapFormatError as error:
            assert "\n" not in str(error).strip()
        else:
            assert grid.cells.dtype == np.int8
            assert grid.cells.min() >= -1 and grid.cells.max() <= 100


def test_an_empty_image_is_rejected():
    with pytest.raises(MapFormatError, match="at least one"):
        encode_pgm(Grid(np.zeros((0, 3), np.int8), 0.05, 0.0, 0.0))
    assert decode_image(pgm([7]), "x").levels.tolist() == [[7]]

"""What a small file can unpack to is limited before it is unpacked; YAML takes less than a second or is refused."""

from __future__ import annotations

import gzip
import re
import struct
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from PIL import Image
from tests.support.mutants.mutations import _png_chunk

from chefbot.config import ConfigError, parse_yaml
from chefbot.design.errors import DesignError
from chefbot.design.export.urdf_xml import UrdfError, parse_urdf_xml
from chefbot.design.sizing.robot_file_editor import Change, changed
from chefbot.errors import ChefbotError, UserError
from chefbot.mapping.image_format import MapFormatError, decode_image
from chefbot.mapping.map_format import decode_map_yaml
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.reader import read_bag
from chefbot.runtime.recorded_log import read_log
from chefbot.slam.carmen import parse
from chefbot.storage import mcap_reading
from chefbot.storage.carmen_log import read_text
from chefbot.storage.places import save_places

MEGABYTE = 1_000_000


def peak_mb(work: Callable[[], object], error: type[ChefbotError], sentence: str) -> float:
    """Largest memory in MB that Python allocates until the error."""
    tracemalloc.start()
    try:
        with pytest.raises(error, match=sentence):
            work()
        return tracemalloc.get_traced_memory()[1] / MEGABYTE
    finally:
        tracemalloc.stop()


def gzip_of_zeros(megabytes: int) -> bytes:
    """One member of zeros; only its first megabyte is compressed, the others are the same block."""
    packer, zeros, checksum = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS), bytes(MEGABYTE), 0
    block = packer.compress(zeros) + packer.flush(zlib.Z_FULL_FLUSH)
    for _ in range(megabytes):
        checksum = zlib.crc32(zeros, checksum)
    end = packer.flush() + struct.pack("<II", checksum, megabytes * MEGABYTE)
    return b"\x1f\x8b\x08" + bytes(6) + b"\xff" + megabytes * block + end


def test_the_gzip_bomb_is_a_valid_file() -> None:
    assert gzip.decompress(gzip_of_zeros(3)) == bytes(3 * MEGABYTE)


def test_a_gzip_bomb_is_refused_within_a_fraction(tmp_path: Path) -> None:
    path = tmp_path / "bomb.log.gz"
    path.write_bytes(gzip_of_zeros(500))
    assert path.stat().st_size < MEGABYTE
    assert peak_mb(lambda: read_text(path), UserError, "unpacks to more than") < 40.0


def test_a_gzip_log_of_many_members_is_limited_as_well(tmp_path: Path) -> None:
    path = tmp_path / "bomb.log.gz"
    path.write_bytes(gzip.compress(bytes(MEGABYTE)) * 100)
    assert peak_mb(lambda: read_text(path), UserError, "unpacks to more than") < 40.0


@pytest.mark.slow
def test_lines_of_a_log_are_read_one_by_one() -> None:
    """A list of these lines, or a copy of the text, would need more than five times the limit."""
    text = (19 * " " + "\n") * (MEGABYTE // 4)
    tracemalloc.start()
    assert list(parse(text)) == []
    assert tracemalloc.get_traced_memory()[1] < MEGABYTE
    tracemalloc.stop()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_log_may_end_its_lines_as_on_any_system(end: str) -> None:
    lines = [f"ODOM {x} 0 0 0 0 0 {x}.0 robot {x}.0" for x in range(3)]
    assert [reading.odom.x for reading in parse(end.join(lines))] == [0.0, 1.0, 2.0]


def png(width: int, height: int, kind: int, data: bytes) -> bytes:
    """A PNG of 8 bits with any data, whose checksums are right."""
    head = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_png_chunk(*chunk, False) for chunk in chunks)


def test_a_png_of_few_bytes_is_not_unpacked_to_many_pixels() -> None:
    side = 8900
    data = png(side, side, 0, zlib.compress(bytes(side * (side + 1)), 9))
    assert len(data) < 80_000
    assert peak_mb(lambda: decode_image(data, "it"), MapFormatError, "so few hold no map of that size") < 1.0


def test_a_png_with_colours_has_a_lower_limit() -> None:
    data = png(6000, 6000, 6, b"x" * MEGABYTE)
    assert peak_mb(lambda: decode_image(data, "it"), MapFormatError, "25000000 is the maximum") < 1.0


def test_a_large_map_of_few_details_is_still_read(tmp_path: Path) -> None:
    cells = np.full((6000, 6000), 205, np.uint8)
    places = np.random.default_rng(1).integers(1000, 5000, (2, 40_000))
    cells[places[0], places[1]] = 0
    Image.fromarray(cells).save(tmp_path / "map.png")
    image = decode_image((tmp_path / "map.png").read_bytes(), "it")
    assert image.levels.shape == (6000, 6000) and image.levels.dtype == np.uint8


def mcap(size: int, packed: bytes, compression: bytes = b"zstd") -> bytes:
    """A file with one chunk that claims to unpack to `size` bytes."""
    body = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression
    body += struct.pack("<Q", len(packed)) + packed
    header = struct.pack("<BQ", 1, 8) + bytes(8)
    return b"\x89MCAP0\r\n" + header + struct.pack("<BQ", 6, len(body)) + body


def many_records(number: int) -> bytes:
    """Very many records of no content."""
    return struct.pack("<BQ", 99, 0) * number


BIG = bytes(400 * MEGABYTE)
BOMBS = {
    "claims much": lambda: mcap(10**15, zstandard.compress(b"x")),
    "claims little, is much": lambda: mcap(1, zstandard.compress(BIG)),
    "is much": lambda: mcap(len(BIG), zstandard.compress(BIG)),
    "lz4, is much": lambda: mcap(len(BIG), lz4.frame.compress(BIG), b"lz4"),
    "lz4, claims little": lambda: mcap(1, lz4.frame.compress(BIG), b"lz4"),
    "many records": lambda: mcap(9 * 10**6, zstandard.compress(many_records(10**6))),
    "record longer than the file": lambda: mcap(1, b"x")[:16] + struct.pack("<BQ", 3, 2**40),
    "chunk longer than the file": lambda: mcap(1, b"x")[:-9] + struct.pack("<Q", 2**40),
    "other compression": lambda: mcap(1, b"x", b"bzip2"),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_mcap_bombs_are_refused_before_they_are_unpacked(bomb: str, tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(BOMBS[bomb]())
    assert path.stat().st_size < 3 * MEGABYTE
    begun = time.process_time()
    assert peak_mb(lambda: read_bag(path), BagError, "not an MCAP file, or cut off") < 60.0
    assert peak_mb(lambda: read_log(path), UserError, "cannot be replayed") < 60.0
    assert time.process_time() - begun < 8.0


def test_a_log_cut_anywhere_is_described_by_a_sentence(tmp_path: Path) -> None:
    from tests.support.mutants.readers import recorded

    whole, path = recorded()[0], tmp_path / "run.mcap"
    for at in sorted({*range(0, 60), *range(60, len(whole), 97)}):
        path.write_bytes(whole[:at])
        with pytest.raises(UserError, match="cannot be replayed: it ") as log:
            read_log(path)
        sentences = [str(log.value)]
        try:
            sentences += read_bag(path).truncated
        except BagError as error:
            sentences.append(str(error))
        for sentence in sentences:
            assert not re.search("unpack requires|Errno|decompress|Error|b'|magic|struct", sentence), (
                at,
                sentence,
            )


def test_all_messages_of_a_file_are_limited_by_its_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.support.mutants.readers import recorded

    (tmp_path / "run.mcap").write_bytes(recorded()[0])
    monkeypatch.setattr(mcap_reading, "FREE_BYTES", 0)
    assert len(read_log(tmp_path / "run.mcap").messages) == 40
    monkeypatch.setattr(mcap_reading, "MAX_RATIO", 0)
    with pytest.raises(UserError, match="unpacks to more than 0 bytes"):
        read_log(tmp_path / "run.mcap")


SLOW_YAML = {
    "90,000 keys": "\n".join(f"k{i}: 1" for i in range(90_000)),
    "values in a list": "[" + "1," * 400_000 + "]",
    "keys without values": "? a\n" * 240_000,
    "a number of base 60": "a: 1" + ":59" * 300_000,
    "digits": "a: " + "9" * 900_000,
    "hexadecimal digits": "a: 0x" + "9" * 900_000,
    "directives": "".join(f"%TAG !a{i}! b\n" for i in range(60_000)) + "--- a",
    "depth": "[" * 900_000,
    "depth of blocks": "- " * 400_000,
    "anchors": "a: &a [x]\nb: [" + "*a," * 200_000 + "]",
    "the same key": "a: 1\n" * 200_000,
}


@pytest.mark.parametrize("case", SLOW_YAML)
def test_large_yaml_is_refused_within_a_second(case: str) -> None:
    begun = time.process_time()
    with pytest.raises(ConfigError, match="not valid YAML"):
        parse_yaml(SLOW_YAML[case].encode(), "it")
    assert time.process_time() - begun < 3.0, "1 s on a machine without other work"


def test_yaml_of_many_values_is_read() -> None:
    begun = time.process_time()
    assert len(parse_yaml("\n".join(f"k{i}: 1.5 m" for i in range(39_000)).encode(), "it")) == 39_000
    assert time.process_time() - begun < 3.0, "1 s on a machine without other work"


def test_a_map_has_few_keys_and_no_misspelt_one() -> None:
    good = "image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    assert decode_map_yaml((good + "frame_id: map\nimage_file: b\n").encode(), "it").resolution == 0.05
    for key in ("resolutions", "free_tresh", "images", "Mode", "negated", "occupied_thres"):
        with pytest.raises(MapFormatError, match=f"unknown key '{key}'.*did you mean"):
            decode_map_yaml(f"{good}mode: trinary\n{key}: 1\n".encode(), "it")
    with pytest.raises(MapFormatError, match="has 106 keys"):
        decode_map_yaml((good + "".join(f"x{i}: 1\n" for i in range(100))).encode(), "it")


@pytest.mark.parametrize("kind", ["elements", "attributes"])
def test_xml_has_a_limited_number_of_parts(kind: str) -> None:
    many = " ".join(f'a{i}=""' for i in range(300_000))
    text = "<r>" + "<a/>" * 300_000 + "</r>" if kind == "elements" else f"<r {many}/>"
    with pytest.raises(UrdfError, match="elements and attributes"):
        parse_urdf_xml(text.encode(), "it")


def test_what_only_one_parser_accepts_has_a_sentence(tmp_path: Path) -> None:
    """A tab within braces: the loader accepts it, the editor, which keeps comments, does not."""
    path = tmp_path / "m.places.yaml"
    path.write_text("places:\n  kitchen: {x: 1.0\tm, y: 0.5 m}\n")
    before = path.read_bytes()
    with pytest.raises(ConfigError, match=r"places file .* cannot be changed: .* in line 2"):
        save_places(path, {})
    assert path.read_bytes() == before
    with pytest.raises(DesignError, match=r"the robot file cannot be changed: .* in line 2"):
        changed("name: r\ndrive: {max_speed: 1.0\tm/s}\n", [Change(("name",), "x")])

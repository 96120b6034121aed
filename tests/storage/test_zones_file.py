"""The zones file beside a map: what is read, and what is refused in one sentence."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chefbot.config import ConfigError
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, SLOW_ZONE
from chefbot.storage.zones import load_zones, zones_path

CORNERS = "corners: [{x: 1 m, y: 2 m}, {x: 300 cm, y: 2 m}, {x: 3 m, y: 4 m}]"
WHOLE = f"""version: 1
zones:
  stairs: {{kind: keep_out, {CORNERS}}}
  ramp: {{kind: slow, speed: 0.15 m/s, {CORNERS}}}
  hall: {{kind: preferred, {CORNERS}}}
  door_in: {{kind: one_way, direction: 90 deg, {CORNERS}}}
"""


def written(folder: Path, text: str) -> Path:
    path = zones_path(folder / "hotel.yaml")
    path.write_text(text)
    return path


def test_all_kinds_are_read_in_si_units(tmp_path: Path) -> None:
    loaded = load_zones(written(tmp_path, WHOLE))
    assert [zone.kind for zone in loaded.zones] == [KEEP_OUT, SLOW_ZONE, PREFERRED, ONE_WAY]
    stairs, ramp, _, door = loaded.zones
    assert stairs.array.tolist() == [[1.0, 2.0], [3.0, 2.0], [3.0, 4.0]]
    assert (ramp.speed, door.direction) == (0.15, pytest.approx(math.pi / 2.0))
    assert (stairs.title, door.title) == ("keep-out zone stairs", "one-way lane door in")
    assert (tmp_path / "hotel.zones.yaml").exists()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("version: 2\nzones: {}", "version 2 is unknown; this chefbot reads version 1"),
        ("zones: {}", "'version' is missing"),
        ("version: 1\nzones: {a: {kind: forbidden}}", "unknown kind 'forbidden'"),
        (f"version: 1\nzones: {{a: {{kind: slow, {CORNERS}}}}}", "'zones.a.speed' is missing"),
        (f"version: 1\nzones: {{a: {{kind: slow, speed: 0.01 m/s, {CORNERS}}}}}", "at least 0.1 m/s"),
        (f"version: 1\nzones: {{a: {{kind: keep_out, sped: 1, {CORNERS}}}}}", "unknown key 'zones.a.sped'"),
        ("version: 1\nzones: {a: {kind: keep_out, corners: [{x: 1, y: 2}]}}", "zones.a.corners.*x"),
        ("version: 1\nzones: {a: {kind: keep_out, corners: [{x: .nan m, y: 2 m}]}}", "zones.a.corners.*x"),
        ("version: 1\nzones: {a: {kind: keep_out, corners: []}}", "zone a: it needs three corners or more"),
        ("version: 1\nzones: {A b: {kind: keep_out, corners: []}}", "zones file .*regex"),
        ("- 1\n", "must be a section"),
        ("a: [", "not valid YAML"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path: Path, text: str, problem: str) -> None:
    with pytest.raises(ConfigError, match=problem) as error:
        load_zones(written(tmp_path, text))
    assert str(error.value).startswith("zones file") and "\n" not in str(error.value)

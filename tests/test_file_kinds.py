"""A file of another kind than expected is named in the error, wherever it is given."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import msgspec
import pytest

from chefbot.buildings.world_file import WorldSpec
from chefbot.errors import ChefbotError, UserError
from chefbot.file_kinds import KEYS, LAUNCH, MAP, PLACES, ROBOT, SCENARIO, WORLD, ZONES, check_kind
from chefbot.proving.scenario import Scenario, load_scenario
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.launch import LaunchFile, load_launch
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places
from chefbot.storage.zones import ZonesFile, load_zones

CHEFBOT = load_robot("chefbot")
TEXTS = {
    ROBOT: "like: chefbot\nname: mine\nwheels: {diameter: 10 cm}\n",
    WORLD: "name: office\nwalls: []\nplaces: {}\n",
    MAP: "image: office.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n",
    ZONES: "version: 1\nzones: {}\n",
    LAUNCH: "include: [navigation]\nnodes: {}\n",
    SCENARIO: "name: doors\ntask: {go: kitchen}\nworld: room\n",
    PLACES: "places: {}\n",
}
PHRASES = {
    ROBOT: "is a robot",
    WORLD: "is a world",
    MAP: "is a map",
    ZONES: "holds the zones of a map",
    LAUNCH: "is a launch",
    SCENARIO: "is a scenario",
    PLACES: "holds the places of a map",
}
READERS: dict[str, Callable[[Path], object]] = {
    ROBOT: lambda path: load_robot(str(path)),
    WORLD: lambda path: load_any_world(str(path), CHEFBOT),
    MAP: load_map,
    ZONES: load_zones,
    LAUNCH: lambda path: load_launch(str(path), {}),
    SCENARIO: lambda path: load_scenario(str(path)),
    PLACES: load_places,
}


@pytest.mark.parametrize("expected", READERS)
@pytest.mark.parametrize("given", TEXTS)
def test_a_file_of_another_kind_is_named(given: str, expected: str, tmp_path: Path) -> None:
    if given == expected or (given, expected) == (MAP, WORLD):  # a map is a world, too
        check_kind(msgspec.yaml.decode(TEXTS[given]), given, "it", UserError)
        return
    path = tmp_path / "office.yaml"
    path.write_text(TEXTS[given])
    with pytest.raises(ChefbotError) as caught:
        READERS[expected](path)
    where = f"{expected} {path}" if expected == SCENARIO else f"{expected} file {path}"
    assert str(caught.value) == f"{where} {PHRASES[given]}, not a {expected} file"


@pytest.mark.parametrize("expected", [WORLD, MAP])
@pytest.mark.parametrize("name", ["office.pgm", "office.PNG"])
def test_a_picture_is_answered_with_its_yaml_file(expected: str, name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"P5\n1 1\n255\n\0")
    with pytest.raises(ChefbotError, match=r"is a picture.* the YAML file beside it, such as office\.yaml$"):
        READERS[expected](path)


def test_a_picture_in_the_present_folder_is_not_a_name() -> None:
    with pytest.raises(UserError, match=r"office\.pgm is a picture"):
        load_any_world("office.pgm", CHEFBOT)


def test_a_wrong_key_does_not_change_the_kind(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(TEXTS[ROBOT] + "walls: []\nimage: a.pgm\n")
    with pytest.raises(ChefbotError, match="unknown key 'walls'"):
        load_robot(str(path))


def test_the_keys_of_a_kind_are_those_of_its_schema_alone() -> None:
    assert all(KEYS[one].isdisjoint(KEYS[other]) for one, other in combinations(KEYS, 2))
    robot, world, zones, launch, scenario = (
        {field.encode_name for field in msgspec.structs.fields(kind)}
        for kind in (Robot, WorldSpec, ZonesFile, LaunchFile, Scenario)
    )
    assert KEYS[ROBOT] == (robot - world) | {"like"}
    assert KEYS[WORLD] == world - robot
    assert KEYS[LAUNCH] == launch - {"description"}
    assert KEYS[SCENARIO] == scenario - robot - world - {"description", "world", "robot", "start"}
    assert KEYS[ZONES] == zones - {"version"}

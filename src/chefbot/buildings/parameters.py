"""The numbers of a building, and the ranges that a seed draws them from."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.random import Generator

from chefbot.errors import ChefbotError, name_hint
from chefbot.maths.number_range import NumberRange, check_name


class BuildingError(ChefbotError):
    """A building that cannot be generated as requested."""


COMMON: Mapping[str, NumberRange] = {
    "door_width": NumberRange(0.8, 1.1, "m", "width of a doorway"),
    "door_leaves": NumberRange(0.0, 0.6, "", "share of doorways with a leaf, open by 60 to 100 %"),
    "closed_doors": NumberRange(0.0, 0.1, "", "share of doorways whose leaf is closed"),
    "loops": NumberRange(0.0, 0.4, "", "share of doorways beyond those that connect every room"),
    "glass": NumberRange(0.0, 0.2, "", "share of inner walls of glass, which light passes"),
    "mirrors": NumberRange(0, 2, "", "mirrors at walls", whole=True),
    "furniture": NumberRange(0.4, 1.0, "", "share of the usual furniture of a room"),
    "clutter": NumberRange(0.0, 0.06, "1/m^2", "things that stand about, per area of floor"),
    "moved_chairs": NumberRange(0.0, 0.03, "1/m^2", "chairs that stand away from a table, per area of floor"),
    "boards": NumberRange(0, 2, "", "boards that hang above the plane of a laser", whole=True),
    "steps": NumberRange(0, 2, "", "platforms of 3 to 15 cm, below the plane of a laser", whole=True),
    "holes": NumberRange(0, 1, "", "holes in the floor, 0.1 to 1 m deep", whole=True),
    "carpets": NumberRange(0.0, 0.3, "", "share of rooms with a carpet, on which the wheels have other grip"),
    "tables": NumberRange(2, 6, "", "tables that the robot serves, at most", whole=True),
    "wall_height": NumberRange(2.4, 3.2, "m", "height of the walls, and of the ceiling"),
}
"""Numbers of every kind."""
KINDS: Mapping[str, Mapping[str, NumberRange]] = {
    "office": {
        "width": NumberRange(15.0, 45.0, "m", "extent along x"),
        "depth": NumberRange(12.0, 30.0, "m", "extent along y"),
        "room_width": NumberRange(3.0, 6.0, "m", "typical width of a room"),
        "room_depth": NumberRange(3.5, 5.5, "m", "typical depth of a room"),
        "corridor": NumberRange(1.5, 2.4, "m", "width of the corridors"),
    },
    "corridors": {
        "loop": NumberRange(50.0, 400.0, "m", "length of the outer loop"),
        "aspect": NumberRange(0.4, 1.0, "", "depth over width"),
        "blocks_x": NumberRange(
            1, 4, "", "solid blocks side by side, with corridors around each", whole=True
        ),
        "blocks_y": NumberRange(1, 3, "", "solid blocks one behind the other", whole=True),
        "corridor": NumberRange(1.4, 2.6, "m", "width of the corridors"),
    },
    "hall": {
        "width": NumberRange(15.0, 60.0, "m", "extent along x"),
        "depth": NumberRange(12.0, 40.0, "m", "extent along y"),
        "column_spacing": NumberRange(4.0, 10.0, "m", "distance between columns"),
        "side_room": NumberRange(3.0, 6.0, "m", "depth of the rooms along one side"),
    },
    "hotel": {
        "width": NumberRange(18.0, 45.0, "m", "extent along x"),
        "depth": NumberRange(11.0, 18.0, "m", "extent along y"),
        "lobby": NumberRange(0.25, 0.4, "", "share of the width for lobby and restaurant"),
        "room_width": NumberRange(3.0, 4.5, "m", "typical width of a guest room"),
        "corridor": NumberRange(1.5, 2.2, "m", "width of the corridor"),
    },
    "warehouse": {
        "width": NumberRange(15.0, 60.0, "m", "extent along x"),
        "depth": NumberRange(12.0, 40.0, "m", "extent along y"),
        "rack_length": NumberRange(2.0, 6.0, "m", "length of a rack"),
        "aisle": NumberRange(1.2, 3.0, "m", "width of the aisles between racks"),
        "shelf": NumberRange(0.1, 0.5, "m", "height below the lowest shelf"),
    },
    "home": {
        "width": NumberRange(8.0, 15.0, "m", "extent along x"),
        "depth": NumberRange(7.0, 13.0, "m", "extent along y"),
        "smallest_room": NumberRange(6.0, 10.0, "m^2", "smallest area of a room"),
    },
    "twins": {
        "rooms": NumberRange(4, 12, "", "rooms built alike in one wing", whole=True),
        "wings": NumberRange(1, 3, "", "wings built alike", whole=True),
        "room_width": NumberRange(3.0, 5.0, "m", "width of a room"),
        "room_depth": NumberRange(3.5, 5.5, "m", "depth of a room"),
        "corridor": NumberRange(1.6, 2.4, "m", "width of the corridors"),
        "clutter": NumberRange(0.0, 0.01, "1/m^2", "things that stand about, per area of floor"),
        "moved_chairs": NumberRange(
            0.0, 0.005, "1/m^2", "chairs that stand away from a table, per area of floor"
        ),
    },
    "narrow": {
        "width": NumberRange(10.0, 20.0, "m", "extent along x"),
        "depth": NumberRange(8.0, 16.0, "m", "extent along y"),
        "gap": NumberRange(0.05, 0.30, "m", "width of doorways and gates beyond that of the robot"),
        "room_width": NumberRange(3.0, 5.0, "m", "typical side of a room"),
    },
}
"""Numbers of each kind beside the common ones, or instead of them."""


def ranges_of(kind: str) -> dict[str, NumberRange]:
    """Return the ranges of all numbers of a kind. Raises BuildingError for an unknown kind."""
    if kind not in KINDS:
        raise BuildingError(f"no kind of building is called {kind!r}{name_hint(kind, KINDS)}")
    return {**COMMON, **KINDS[kind]}


def draw_numbers(kind: str, given: Mapping[str, float], rng: Generator) -> dict[str, float]:
    """Draw every number of the kind from its range, and replace those that are given.

    Given numbers do not change what the others are drawn as. Raises BuildingError for an unknown name or kind, and
    for a number outside its range.
    """
    ranges = ranges_of(kind)
    for name, value in given.items():
        check_name(f"a building of kind {kind}", name, ranges, BuildingError)
        ranges[name].check(f"{name} of a building of kind {kind}", value, BuildingError)
    drawn = {name: one.draw(rng) for name, one in ranges.items()}
    return {**drawn, **given}

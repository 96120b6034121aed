"""Which tables order in the demo."""

from __future__ import annotations

import dataclasses

import pytest

from chefbot.demo.run import chosen_tables
from chefbot.errors import UserError
from chefbot.sim.world.world import World, load_world

HOTEL = load_world("hotel")


def with_tables(count: int) -> World:
    tables = [name for name in HOTEL.places if name.startswith("table_")][:count]
    kept = {name: place for name, place in HOTEL.places.items() if name in (*tables, "kitchen", "home")}
    return dataclasses.replace(HOTEL, places=kept)


@pytest.mark.parametrize(("count", "chosen"), [(1, 1), (2, 2), (3, 3), (5, 3)])
def test_three_tables_order_or_all_that_there_are(count: int, chosen: int) -> None:
    world = with_tables(count)
    tables = chosen_tables(world, 7)
    assert len(set(tables)) == chosen and set(tables) <= set(world.places)
    assert chosen_tables(world, 7) == tables


def test_a_world_without_tables_is_reported_in_one_sentence() -> None:
    with pytest.raises(UserError, match="nowhere to go"):
        chosen_tables(with_tables(0), 7)

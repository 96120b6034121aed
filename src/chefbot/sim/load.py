"""Worlds by name, by world file, or extruded from any ROS map."""

from __future__ import annotations

from pathlib import Path

from chefbot.config import parse_yaml, read_bytes
from chefbot.runtime.files import load_map
from chefbot.sim.map_world import world_from_map
from chefbot.sim.world import World, load_world


def load_any_world(name_or_path: str) -> World:
    """A YAML file with the key `image` is a map, any other a world."""
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml"):
        plain = parse_yaml(read_bytes(path, "world file"), f"world file {path}")
        if isinstance(plain, dict) and "image" in plain:
            return world_from_map(path.stem, load_map(path))
    return load_world(name_or_path)

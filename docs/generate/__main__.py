"""Write all generated pages into a folder: `python -m generate FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

from generate.api import write_api
from generate.behavior_trees import write_behavior_trees
from generate.buildings import write_buildings
from generate.commands import write_commands
from generate.faults import write_faults
from generate.launches import write_launches, write_nodes, write_topics
from generate.robots import write_robots
from generate.scenarios import write_scenarios


def write_all(folder: Path) -> None:
    """Write the pages of the reference that are made from the code below `folder`."""
    write_api(folder / "api")
    write_launches(folder / "launches.rst")
    write_nodes(folder / "nodes.rst")
    write_behavior_trees(folder / "behavior_trees.rst")
    write_buildings(folder / "buildings.rst")
    write_faults(folder / "faults.rst")
    write_robots(folder / "robots.rst")
    write_scenarios(folder / "scenarios.rst")
    write_topics(folder / "topics.rst")
    write_commands(folder / "command_line.rst")


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))

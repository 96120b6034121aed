"""Launches of the built robot: its devices, and no simulator."""

from __future__ import annotations

import subprocess
import sys

import pytest

from chefbot.errors import UserError
from chefbot.runtime.launch import built_in_launches, load_launch

BUILT = [name for name in built_in_launches() if "built" in load_launch(name).args]
ALWAYS_BUILT = ["robot_standalone", "calibrate"]
IMPORTS = """
import sys
import chefbot.launcher.launch, chefbot.launcher.worker
from chefbot.runtime.launch import load_launch, node_class
given = {"built": "true"} if sys.argv[2] == "built" else {}
for entry in load_launch(sys.argv[1], given).nodes.values():
    node_class(entry.kind, "test")
print([name for name in sys.modules if name == "mujoco" or name.startswith("chefbot.sim")])
"""


def test_the_chapter_s_launches_are_among_them() -> None:
    assert {"gmapping_demo", "amcl_demo", "waiter", "3dsensor", "explore"} <= set(BUILT)


@pytest.mark.rotated
@pytest.mark.parametrize("name", [*BUILT, *ALWAYS_BUILT])
@pytest.mark.slow
def test_the_processes_of_a_built_robot_have_no_simulator(name: str) -> None:
    kind = "built" if name in BUILT else "always"
    command = [sys.executable, "-c", IMPORTS, name, kind]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == "[]"


@pytest.mark.parametrize("name", BUILT)
def test_board_and_lidar_take_the_place_of_the_simulator(name: str) -> None:
    simulated, built = load_launch(name), load_launch(name, {"built": "true"})
    assert (simulated.clock, built.clock) == ("simulation", "wall")
    assert {"board", "lidar"} <= set(built.nodes) and "simulator" not in built.nodes
    assert "world" in simulated.args and "world" not in built.args
    with pytest.raises(UserError, match="world"):
        load_launch(name, {"built": "true", "world": "hotel"})
    with pytest.raises(UserError, match="lidar_port"):
        load_launch(name, {"lidar_port": "/dev/ttyUSB0"})


def test_a_launch_of_the_simulator_alone_is_never_built() -> None:
    with pytest.raises(UserError, match="no argument 'built'"):
        load_launch("chefbot_empty_world", {"built": "true"})

"""Build of the package: compiles the firmware for the simulator.

Where the machine has no C++ compiler, pip fetches one for the build alone (`ziglang`, 100 MB), and throws it away.
"""

from __future__ import annotations

import runpy
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

LIBRARY = "src/chefbot/sim/_firmware/libchefbot_board.so"


class BoardHook(BuildHookInterface[Any]):
    """For wheels and for editable installs alike."""

    def dependencies(self) -> list[str]:
        """What the build needs besides hatchling."""
        return [] if self._builder()["compiler"]() else ["ziglang>=0.13"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Compile; the wheel is then for this kind of machine, and for any Python."""
        self._builder()["build"](Path(self.root, LIBRARY))
        build_data["artifacts"].append(LIBRARY)
        build_data["pure_python"] = False
        build_data["tag"] = "py3-none-" + sysconfig.get_platform().replace("-", "_").replace(".", "_")

    def _builder(self) -> dict[str, Any]:
        return runpy.run_path(str(Path(self.root, "firmware/ports/host/build.py")))

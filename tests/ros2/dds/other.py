"""The other process: a peer on DDS that knows nothing of chefbot."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.support.waiting import PATIENCE

PROGRAM = Path(__file__).parent / "peer.py"
LOOPBACK = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>
</Discovery></Domain></CycloneDDS>"""


class Peer:
    """The other process: `peer.read("rt/scan", "LaserScan")` and the like."""

    def __init__(self, domain: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(PROGRAM), str(domain)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "CYCLONEDDS_URI": LOOPBACK},
        )
        assert self._answer() == "ready"

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*values: Any) -> Any:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps([name, *values]) + "\n")
            self._process.stdin.flush()
            return self._answer()

        return call

    def close(self, *, kill: bool = False) -> None:
        """By the end of its input, or by force."""
        if kill:
            self._process.kill()
        self._process.communicate(timeout=PATIENCE)

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, "the other process has died"
        return json.loads(line)

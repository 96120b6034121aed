"""Ctrl-C in `chefbot demo`: a notice at once, what is done in the report, and no failure."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.support.waiting import PATIENCE, wait_for

from chefbot.maths.grid import FREE
from chefbot.storage.map_files import load_map

RECORDED = 200_000
"""Size of a recording that has a map, bytes."""
pytestmark = pytest.mark.slow


@pytest.mark.rotated("demo in the room")
def test_an_interrupted_demo_reports_what_is_done(tmp_path: Path) -> None:
    arguments = ["demo", "--headless", "--world", "room", "--out", str(tmp_path)]
    command = [sys.executable, "-u", "-m", "chefbot", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert any("Exploring" in line for line in iter(process.stdout.readline, ""))
        wait_for(lambda: (tmp_path / "run.mcap").stat().st_size > RECORDED)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err == "\nEnding; the report of what is done is written.\n"
    assert "Interrupted before it was done; pictures in" in out and "failed" not in out
    assert json.loads((tmp_path / "summary.json").read_text())["failure"] == "interrupted before it was done"
    assert (tmp_path / "report.html").exists()
    assert (load_map(tmp_path / "map.yaml").cells == FREE).any(), "the map so far"

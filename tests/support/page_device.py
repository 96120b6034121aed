"""A part of the web UI's device alone in a launch, with its files in a folder of the test."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.nodes import NodeRunner


@contextmanager
def page_device(kind: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    """Run the device of a class, `module:Class`, as the node `page`."""
    monkeypatch.setenv("CHEFBOT_STATE", str(folder))
    runner = NodeRunner({"page": kind}, {})
    yield runner
    runner.system.stop()

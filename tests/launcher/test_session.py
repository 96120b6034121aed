"""The start of a session: what is loaded is left out of garbage collections, which would stop the loop."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from chefbot.launcher.session import session, start
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch


@pytest.fixture(autouse=True)
def thawed() -> Iterator[None]:
    yield
    gc.unfreeze()


def test_collections_leave_out_what_a_launch_has_loaded() -> None:
    launch = load_launch("base", {"robot": "chefbot_lidar"})
    before = len(gc.get_objects())
    with session(load_robot("chefbot_lidar"), 1, "simulation", 0.0, None) as system:
        start(system, launch)
        assert gc.get_freeze_count() > 0.9 * before
        assert len(gc.get_objects()) < 0.1 * before

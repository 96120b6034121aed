"""The start of a session: what is loaded is left out of garbage collections, which would stop the loop."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from chefbot.launcher.session import print_fault, session, start
from chefbot.robot.load import load_robot
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.launch import load_launch
from chefbot.runtime.transform_buffer import TransformError


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


@pytest.mark.parametrize(
    ("error", "has_traceback"), [(TransformError("no frame"), False), (KeyError("x"), True)]
)
def test_only_a_program_error_has_a_traceback(
    error: Exception, has_traceback: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        raise error
    except Exception as raised:
        print_fault(Fault("node <- scan", raised))
    stderr = capsys.readouterr().err
    assert stderr.startswith("Fault: ") and ("Traceback" in stderr) == has_traceback


def test_a_stop_while_the_nodes_start_ends_the_run_behind_it() -> None:
    launch = load_launch("base", {"robot": "chefbot_lidar"})
    with session(load_robot("chefbot_lidar"), 1, "simulation", 1.0, None) as system:
        system.loop.schedule(3600 * 10**9, 0, lambda: None)
        system.loop.stop()
        start(system, launch)
        assert not system.nodes
        system.loop.run()
        assert system.loop.now_ns < 10**9

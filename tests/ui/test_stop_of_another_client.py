"""Tests the emergency stop with two web UIs of a robot: both show the state of the base."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.support.two_web_uis import Robot
from tests.support.waiting import PATIENCE

from chefbot.ui.commands import ReleaseStop, Stop
from chefbot.ui.pending_requests import STOP_UNCONFIRMED
from chefbot.ui.remote.web_ui_client import WebUiClient


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Robot]:
    running = Robot(base=getattr(request, "param", True))
    yield running
    running.stop()


def shows(page: WebUiClient, **expected: object) -> bool:
    """Receive layers and return whether the status gets the expected values."""
    for _ in range(200):
        status = page.latest.get("status")
        if status and expected.items() <= status.items():
            return True
        page.receive(PATIENCE)
    return False


@pytest.mark.slow
def test_stop_on_one_page_shows_on_all_and_any_page_resumes(robot: Robot) -> None:
    with robot.page("here") as here, robot.page("there") as there:
        assert shows(here, stopped=False)
        here.send(Stop())
        assert shows(there, stopped=True, reason="Emergency stop was pressed.")
        assert shows(here, stopped=True, stop_pending=False)
        there.send(ReleaseStop())
        assert shows(here, stopped=False)
        assert shows(there, stopped=False)
    assert robot.stop_states == [False, True, False]
    assert robot.stop_requests[-1] is False


@pytest.mark.slow
def test_all_screens_show_who_pressed_stop(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        robot.system.nodes["here"]._receive(Stop(), "Anna")  # type: ignore[attr-defined]
        assert shows(page, stopped=True, reason="Anna pressed the emergency stop.")
        page.send(ReleaseStop())
        assert shows(page, stopped=False)
        page.send(Stop())
        assert shows(page, stopped=True, reason="Emergency stop was pressed."), "a shared link has no name"


@pytest.mark.slow
def test_an_external_stop_counts_and_only_a_page_resumes_it(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        robot.publish("emergency_stop", True)
        assert shows(page, stopped=True)
        robot.publish("emergency_stop", False)
        page.receive(PATIENCE)
        assert shows(page, stopped=True)
        assert robot.stop_states[-2:] == [False, True]  # the base republishes its state
        page.send(ReleaseStop())
        assert shows(page, stopped=False)


@pytest.mark.parametrize("robot", [False], indirect=True)
@pytest.mark.slow
def test_an_unconfirmed_stop_is_repeated_until_confirmed(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        page.send(Stop())
        assert shows(page, stopped=False, stop_pending=True)
        assert shows(page, stopped=False, stop_pending=True, reason=STOP_UNCONFIRMED)
        assert len(robot.stop_requests) > 3 and all(robot.stop_requests)
        robot.publish("emergency_stop", True)
        assert shows(page, stopped=True, stop_pending=False)
        count = len(robot.stop_requests)
        page.receive(PATIENCE)
        assert len(robot.stop_requests) == count


@pytest.mark.parametrize("robot", [False], indirect=True)
@pytest.mark.slow
def test_no_state_is_shown_before_the_base_has_reported_it(robot: Robot) -> None:
    """After a restart of its process, a page would otherwise show for a moment that a stopped robot may drive."""
    with robot.page("here") as page:
        assert shows(page, stopped=False) and "stop" not in page.latest
        robot.publish("emergency_stop", True)
        assert shows(page, stopped=True) and page.latest["stop"]["stopped"]

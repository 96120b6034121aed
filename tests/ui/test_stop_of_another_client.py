"""Two pages of one robot, as on two machines: STOP shows on both, and the base alone says how it stands."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.support.two_web_uis import Robot
from tests.support.waiting import PATIENCE

from chefbot.ui.commands import Resume, Stop
from chefbot.ui.pending_requests import STOP_UNCONFIRMED
from chefbot.ui.web_ui_client import WebUiClient


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Robot]:
    one = Robot(base=getattr(request, "param", True))
    yield one
    one.stop()


def shows(page: WebUiClient, **wanted: object) -> bool:
    """Whether the page's status does so before long."""
    for _ in range(200):
        status = page.latest.get("status")
        if status and wanted.items() <= status.items():
            return True
        page.receive(PATIENCE)
    return False


def test_stop_on_one_page_shows_on_all_and_any_page_resumes(robot: Robot) -> None:
    with robot.page("here") as here, robot.page("there") as there:
        assert shows(here, stopped=False)
        here.send(Stop())
        assert shows(there, stopped=True, reason="Emergency stop was pressed.")
        assert shows(here, stopped=True, stop_pending=False)
        there.send(Resume())
        assert shows(here, stopped=False)
        assert shows(there, stopped=False)
    assert robot.said == [False, True, False]
    assert robot.asked[-1] is False


def test_an_external_stop_counts_and_only_a_page_resumes_it(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        robot.say("emergency_stop", True)
        assert shows(page, stopped=True)
        robot.say("emergency_stop", False)
        page.receive(PATIENCE)
        assert shows(page, stopped=True)
        assert robot.said[-2:] == [False, True]  # the last word is the base's
        page.send(Resume())
        assert shows(page, stopped=False)


@pytest.mark.parametrize("robot", [False], indirect=True)
def test_an_unconfirmed_stop_is_repeated_until_confirmed(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        page.send(Stop())
        assert shows(page, stopped=False, stop_pending=True)
        assert shows(page, stopped=False, stop_pending=True, reason=STOP_UNCONFIRMED)
        assert len(robot.asked) > 3 and all(robot.asked)
        robot.say("emergency_stop", True)
        assert shows(page, stopped=True, stop_pending=False)
        count = len(robot.asked)
        page.receive(PATIENCE)
        assert len(robot.asked) == count

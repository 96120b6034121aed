"""The web UI's list of causes: what it is given, and what an operator sees of it."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.causes.history import CauseHistory
from chefbot.causes.reports import DETOUR, END, STOP
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.std_msgs import Header
from chefbot.ui.causes.cause_views import SHOWN_CAUSES, cause_views
from chefbot.ui.display.views import CauseView, StatusView

SECOND = 1_000_000_000
CHAIN = ("controller: admissible twists", "lidar: x 2.00 m, y 1.00 m", "obstacle: person 3")


def cause(number: int, kind: str, seconds: int, *, frame: str = "map", sentence: str = "") -> Cause:
    return Cause(
        Header.of(seconds * SECOND, frame),
        number,
        kind,
        located=True,
        point=Point(2.0, 1.0, 0.0),
        chain=CHAIN,
        sentence=sentence or f"Sentence {number}.",
    )


def test_the_newest_causes_come_first_with_their_ends() -> None:
    history = CauseHistory([cause(1, STOP, 1), cause(2, DETOUR, 2, frame="odom"), cause(1, END, 4)])
    detour, stop = cause_views(history, {})
    assert (detour.effect, detour.ended, detour.x, detour.y) == ("Detour", None, None, None)
    assert stop == CauseView(
        id=1, time=1.0, ended=4.0, effect="Stopped", sentence="Sentence 1.", chain=CHAIN, x=2.0, y=1.0
    )


def test_the_list_is_short() -> None:
    history = CauseHistory((cause(number, STOP, number) for number in range(1, 40)), SHOWN_CAUSES)
    assert [view.id for view in cause_views(history, {})] == list(range(39, 39 - SHOWN_CAUSES, -1))


@pytest.mark.slow
@needs_chromium
def test_the_page_shows_each_cause_with_its_chain(page: Any) -> None:
    show_a_room(page.server)
    history = CauseHistory(
        [
            cause(1, STOP, 61, sentence="<b>the lidar</b> sees an obstacle."),
            cause(1, END, 63),
            cause(
                2,
                STOP,
                70,
                sentence="The controller has no collision-free command. The lidar marked person 3.",
            ),
        ]
    )
    page.server.set_layer("causes", cause_views(history, {}))
    page.server.set_layer("status", StatusView(phase="Driving.", reason=history.sentence))
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#causes > li').length === 2")
        heads = tab.evaluate(
            "[...document.querySelectorAll('#causes summary')].map(e => e.textContent).join('|')"
        )
        assert heads == (
            "01:10 Stopped: The controller has no collision-free command. The lidar marked person 3.|"
            "01:01 Stopped 2.0 s: <b>the lidar</b> sees an obstacle."
        )
        tab.evaluate("document.querySelector('#causes details').open = true")
        links = tab.evaluate("document.querySelector('#causes details ol').innerText")
        assert links.split("\n") == list(CHAIN)
        assert "person 3" in tab.evaluate("document.getElementById('reason').textContent")
        # the list is replaced; what was opened stays open
        history.process(cause(2, END, 75))
        page.server.set_layer("causes", cause_views(history, {}))
        tab.wait_for("document.querySelector('#causes summary').textContent.includes('5.0 s')")
        assert tab.evaluate("document.querySelector('#causes details').open") is True


@pytest.mark.slow
@needs_chromium
def test_times_of_an_earlier_run_are_under_a_heading(page: Any) -> None:
    """An earlier run had another clock, so its entries have a date."""
    show_a_room(page.server)
    now = cause_views(CauseHistory([cause(1, STOP, 61)]), {})
    earlier = [
        CauseView(id=n, time=0.0, ended=2.0, effect="Stopped", sentence="Old.", began="2026-01-01T10:00:00Z")
        for n in (4, 3)
    ]
    page.server.set_layer("causes", (*now, *earlier))
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("document.querySelectorAll('#causes > li').length === 4")
        heads = tab.evaluate("[...document.querySelectorAll('#causes > li')].map(e => e.textContent)")
        assert heads[0].startswith("01:01 Stopped") and heads[1] == "Before the last start:"
        assert all("26" in head for head in heads[2:])

"""Tests in Chromium that the web UI shows when the robot reaches each stop of a round."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.msgs.chefbot_msgs.deliveries import RoundForecast, RoundStop
from chefbot.msgs.std_msgs import Header
from chefbot.ui.commands import ShortestOrder
from chefbot.ui.delivery_view import forecast_views
from chefbot.ui.display.views import DeliveryView, RoundStopView, StopView

DRIVING = DeliveryView(
    state="driving", place="table_1", queue=("table_2", "table_1"), round_active=True, order_id="a"
)
CHIPS = "[...document.querySelectorAll('#queue small')].map((one) => one.textContent).join('|')"


def stop(place: str, distance: float, time: float, battery: float | None = 70.0) -> RoundStopView:
    return RoundStopView(place=place, distance=distance, time=time, battery=battery)


STOPS = (
    stop("table_1", 12, 40),
    stop("table_2", 20, 130),
    stop("table_1", 31, 300),
    stop("home", 45, 660, 61),
)


def test_a_forecast_is_sent_only_when_it_looks_different() -> None:
    exact = RoundForecast(
        Header(), "a", (RoundStop("table_1", 12.4, 43.0, 0.7), RoundStop("home", 19.6, 96.0))
    )
    views = forecast_views(exact)
    assert views == (stop("table_1", 12.0, 40.0), stop("home", 20.0, 100.0, None))


@pytest.mark.slow
@needs_chromium
class TestInChromium:
    @pytest.fixture
    def tab(self, page: Any) -> Iterator[Tab]:
        show_a_room(page.server)
        page.server.set_layer("delivery", DRIVING)
        page.server.set_layer("forecast", STOPS)
        with open_tab(page.url, NO_GPU) as tab:
            tab.wait_for("document.getElementById('eta').textContent")
            yield tab

    def test_each_table_has_its_own_time(self, page: Any, tab: Tab) -> None:
        eta = tab.evaluate("document.getElementById('eta').textContent")
        assert eta == "Table 1: 12 m, about 40 s. Back home: 45 m, about 11 min, 61 % battery."
        second = "31 m · 5 min · 70 %"
        assert tab.evaluate(CHIPS) == f"20 m · 2 min · 70 %|{second}"
        page.server.set_layer("forecast", (stop("table_1", 5, 20, None), stop("home", 9, 50, None)))
        tab.wait_for(f"{CHIPS} === '|'")
        assert "%" not in tab.evaluate("document.getElementById('eta').textContent")

    def test_a_table_without_a_path_has_no_metres(self, page: Any, tab: Tab) -> None:
        unreachable = RoundStopView(place="table_1", distance=0, time=0, battery=None, reachable=False)
        page.server.set_layer("forecast", (unreachable, STOPS[1], unreachable, STOPS[3]))
        tab.wait_for(f"{CHIPS} === '20 m · 2 min · 70 %|no path on the map'")
        eta = tab.evaluate("document.getElementById('eta').textContent")
        assert eta == "Table 1: no path on the map. Back home: 45 m, about 11 min, 61 % battery."

    def test_at_a_table_the_next_ones_are_shown(self, page: Any, tab: Tab) -> None:
        waiting = DeliveryView(
            state="waiting", place="table_1", queue=("table_2",), waits_for="taken", round_active=True
        )
        page.server.set_layer("delivery", waiting)
        page.server.set_layer("forecast", STOPS[1:2] + STOPS[3:])
        tab.wait_for(f"{CHIPS} === '20 m · 2 min · 70 %'")
        assert tab.evaluate("document.getElementById('eta').textContent").startswith("Back home: 45 m")

    def test_times_of_a_stopped_robot_are_marked(self, page: Any, tab: Tab) -> None:
        marked = "document.getElementById('eta').textContent.endsWith('Times count from when the robot continues.')"
        assert not tab.evaluate(marked)
        page.server.set_layer("stop", StopView(stopped=True))
        tab.wait_for(marked)
        page.server.set_layer("stop", StopView())
        tab.wait_for(f"!{marked}")
        choice = DeliveryView(state="driving", place="table_1", waits_for="choice", round_active=True)
        page.server.set_layer("delivery", choice)
        tab.wait_for(marked)

    def test_without_a_round_there_is_nothing_left_of_it(self, page: Any, tab: Tab) -> None:
        page.server.set_layer(
            "delivery", DeliveryView(state="idle")
        )  # the forecast may be that of a dead process
        tab.wait_for("document.getElementById('eta').textContent === ''")
        assert tab.evaluate("document.getElementById('shortest').hidden")

    def test_the_shortest_order_is_one_press(self, page: Any, tab: Tab) -> None:
        tab.evaluate("document.getElementById('shortest').click()")
        assert page.next_command() == ShortestOrder("a")
        page.server.set_layer(
            "delivery", DeliveryView(state="driving", queue=("table_2",), round_active=True)
        )
        tab.wait_for("document.getElementById('shortest').hidden")

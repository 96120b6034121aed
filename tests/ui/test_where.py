"""Tests in Chromium of the sentence that states where the robot is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab

from chefbot.ui.commands import InitialPose
from chefbot.ui.display.views import RobotView, StopView

pytestmark = [pytest.mark.slow, needs_chromium]
PLACES = {"table_4": (5.0, 1.0, 0.0), "kitchen": (0.0, 0.0, 0.0)}


def test_the_sentence_names_place_goal_distance_and_time(page: Any) -> None:
    path = np.column_stack([np.linspace(1.0, 5.0, 41), np.ones(41)])
    steps: list[tuple[dict[str, Any], str]] = [
        ({}, "The robot does not know where it is."),
        ({"robot": RobotView(x=1.5, y=-2.25, yaw=0.0)}, "The robot is at x 1.5 m, y -2.3 m. It is stopped."),
        (
            {"places": PLACES, "robot": RobotView(x=0.1, y=0.1, yaw=0.0)},
            "The robot is at Kitchen. It is stopped.",
        ),
        (
            {"robot": RobotView(x=3.0, y=1.05, yaw=0.0, v=0.25), "path": path, "goal": PLACES["table_4"]},
            "The robot is 2.0 m from Table 4. It is on its way to Table 4: 2.0 m to go, about 8 s.",
        ),
        (
            {"robot": RobotView(x=3.0, y=1.0, yaw=0.0), "goal": (20.0, 1.0, 0.0)},
            "The robot is 2.0 m from Table 4. It is on its way to a point on the map: 2.0 m to go.",
        ),
        ({"stop": StopView(stopped=True)}, "The robot is 2.0 m from Table 4. It is stopped."),
        (
            {"stop": StopView(), "path": None, "robot": RobotView(x=3.0, y=1.0, yaw=0.0, v=-0.1)},
            "The robot is 2.0 m from Table 4. It is moving at 0.1 m/s.",
        ),
    ]
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for("!document.body.classList.contains('offline')")
        for layers, sentence in steps:
            for layer, value in layers.items():
                page.server.set_layer(layer, value)
            shown = "(document.getElementById('where').click(), document.getElementById('where-text').textContent)"
            tab.wait_for(f"{shown} === '{sentence}'")
        page.server.set_layer("stop", StopView(stopped=True))
        # it was about another moment
        tab.wait_for("document.getElementById('where-text').textContent === ''")


def test_the_pose_of_a_place_is_chosen_from_a_list(page: Any) -> None:
    with open_tab(page.url, NO_GPU) as tab:
        page.server.set_layer("places", {"table_4": (5.0, 1.0, 0.5), "kitchen": (0.0, 0.0, 0.0)})
        tab.wait_for("document.querySelectorAll('#is-at option').length === 3")
        tab.evaluate(
            "(() => { const list = document.getElementById('is-at'); list.value = 'table_4';"
            " list.dispatchEvent(new Event('change')); return list.value; })()"
        )
        assert page.next_command() == InitialPose(5.0, 1.0, 0.5)
        assert tab.evaluate("document.getElementById('is-at').value") == "", "it can be chosen again"

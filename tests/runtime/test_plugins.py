"""Plugins named in launch files, and the shutdown on signals."""

from __future__ import annotations

import os
import signal
from typing import Any

import numpy as np
import pytest

from chefbot.control.controller import Controller
from chefbot.costmap.layer import CostmapLayer
from chefbot.errors import UserError
from chefbot.planning import planner
from chefbot.runtime import plugins
from chefbot.runtime.launch import node_class
from chefbot.runtime.plugins import load_plugin
from chefbot.signals import stop_on_signals


class Planner:
    """A planner that keeps its settings."""

    def __init__(self, settings: Any) -> None:
        self.settings = settings


def test_an_empty_name_means_the_built_in() -> None:
    assert load_plugin("", Planner, 5, object).settings == 5


def test_a_class_is_found_by_module_and_name_or_by_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"{__name__}:Planner"
    assert load_plugin(name, dict, 7, object).settings == 7
    point = type("Point", (), {"name": "mine", "value": name})
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point] if group == "chefbot.plugins" else [])
    assert type(load_plugin("mine", dict, 7, object)).__name__ == "Planner"


@pytest.mark.parametrize(
    "name", ["no_such_module:X", "math:no_such", "math", ":", "..x:y", ".:X", ".math:sin"]
)
def test_a_missing_plugin_is_refused_with_its_name(name: str) -> None:
    with pytest.raises(UserError, match="cannot be imported"):
        load_plugin(name, Planner, None, object)


@pytest.mark.parametrize("kind", ["no_such_module:X", "math:no_such", "math", ".math:sin"])
def test_a_missing_node_class_is_refused_with_its_name(kind: str) -> None:
    with pytest.raises(UserError, match="cannot be imported"):
        node_class(kind, "launch x: node y")


def test_a_plugin_must_be_a_class() -> None:
    with pytest.raises(UserError, match="is not a class"):
        load_plugin("math:sin", Planner, None, object)


@pytest.mark.parametrize(
    ("interface", "method"),
    [(planner.Planner, "plan"), (Controller, "set_path"), (CostmapLayer, "process")],
)
def test_a_plugin_has_the_methods_of_its_interface(interface: type, method: str) -> None:
    with pytest.raises(UserError, match=f"no method '{method}'"):
        load_plugin(f"{__name__}:Planner", dict, 7, interface)


@pytest.mark.parametrize("path", [None, np.zeros((4, 2)), np.zeros(3), "path", np.full((2, 3), np.nan)])
def test_a_path_of_a_plugin_is_an_array_of_poses(path: Any) -> None:
    with pytest.raises(planner.InvalidPathError, match="mine:Planner"):
        planner.checked_path(path, "mine:Planner")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stop_is_called_and_the_handlers_are_restored(number: int) -> None:
    before, calls = signal.getsignal(number), list[int]()
    with stop_on_signals(lambda: calls.append(1)):
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), number)
    assert calls == [1, 1] and signal.getsignal(number) is before


def test_the_notice_is_written_at_the_first_signal(capfd: pytest.CaptureFixture[str]) -> None:
    with stop_on_signals(lambda: None, notice="Ending."):
        assert capfd.readouterr().err == ""
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
    assert capfd.readouterr().err == "\nEnding.\n"


def test_later_signals_are_ignored_during_the_last_shutdown() -> None:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with stop_on_signals(lambda: None, last=True):
            pass
        assert signal.getsignal(signal.SIGTERM) == before[signal.SIGTERM], "no signal was received"
        with stop_on_signals(lambda: None, last=True):
            os.kill(os.getpid(), signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_IGN
        os.kill(os.getpid(), signal.SIGTERM)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

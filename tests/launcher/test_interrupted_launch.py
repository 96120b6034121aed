"""Ctrl-C before the nodes of a launch run ends it as afterwards: with a notice and exit code 0."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from typing import Any

import pytest

from chefbot.launcher import launch

pytestmark = pytest.mark.slow


def interrupted(step: Callable[..., Any]) -> Callable[..., Any]:
    """Return the step with a SIGINT to this process before it."""

    def run(*args: Any, **options: Any) -> Any:
        os.kill(os.getpid(), signal.SIGINT)
        return step(*args, **options)

    return run


@pytest.mark.parametrize("step", ["compile_kernels", "_session"])
def test_a_launch_ended_while_it_starts_has_not_failed(
    step: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(launch, step, interrupted(getattr(launch, step)))
    assert launch.run_launch("chefbot_empty_world", ["headless:=true", "speed:=0", "duration:=1"]) == 0
    assert "The launch was ended." in capsys.readouterr().out

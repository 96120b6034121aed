"""The secure router's process is replaced so that other routers take the next one for a new one."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.waiting import wait_for

from chefbot.fleet import secure_router
from chefbot.fleet.secure_router import REJOIN_PAUSE, ExternalEndpoints, SecureRouter

TREES_PERIOD = 0.1
"""Zenoh's period of the computation of routing trees, s."""


@pytest.fixture
def gate(port: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[SecureRouter]:
    """A router that is checked often, so that a restart takes no longer than its pause."""
    monkeypatch.setattr(secure_router, "POLL_PERIOD", 0.01)
    with SecureRouter(None, ExternalEndpoints(), port) as router:
        yield router


def kill(gate: SecureRouter) -> int:
    killed = gate.process_id
    os.kill(killed, signal.SIGKILL)
    return killed


@pytest.mark.slow
def test_routers_compute_their_trees_before_the_next_joins(gate: SecureRouter) -> None:
    start = time.monotonic()
    killed = kill(gate)
    wait_for(lambda: gate.process_id != killed)
    assert time.monotonic() - start >= REJOIN_PAUSE >= 10 * TREES_PERIOD


def test_the_former_process_ends_without_closing_its_links(
    gate: SecureRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is killed: closed links, one after the other, would begin a computation before the last one."""
    former = gate._process
    monkeypatch.setattr(secure_router, "router_config", lambda *_: {**gate._config, "id": "abc"})
    wait_for(lambda: former.returncode is not None)
    assert former.returncode == -signal.SIGKILL


def test_a_router_closes_within_the_pause(gate: SecureRouter, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(secure_router, "REJOIN_PAUSE", 3600.0)
    killed = kill(gate)
    wait_for(lambda: not Path(f"/proc/{killed}").exists())
    gate.close()
    assert gate.process_id == killed

"""Tests in Chromium that on a slow link nothing old queues up, and that the web UI shows how old its view is."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab
from tests.ui.faulty_network import FaultyNetwork

from chefbot.ui.commands import Stop

pytestmark = [pytest.mark.slow, needs_chromium]
AGE = "Number(document.getElementById('age').textContent.match(/[\\d.]+/)?.[0] ?? 0)"
SHOWN = "!document.getElementById('age').hidden"
OLDEST = 4.0
"""Age in seconds that a link of 20 kB/s never shows: 0.6 s are under way at most; without a limit it grows."""


@pytest.fixture
def network(page: Any) -> Iterator[FaultyNetwork]:
    between = FaultyNetwork(urlsplit(page.url).port or 0)
    yield between
    between.close()


def flood(page: Any, ended: threading.Event) -> None:
    """Set pictures of 30 kB, five each second."""
    rng = np.random.default_rng(1)
    while not ended.wait(0.2):
        page.server.set_layer("camera", rng.integers(0, 256, (160, 200, 3)).astype(np.uint8))
        page.server.set_layer("scan", _scan(rng))


def _scan(rng: np.random.Generator) -> Any:
    from chefbot.ui.display.views import ScanView

    return ScanView((0.0, 0.0, 0.0), np.linspace(-3.0, 3.0, 360), rng.uniform(1.0, 2.0, 360))


def test_a_slow_link_shows_its_age_and_stops_soon(page: Any, network: FaultyNetwork) -> None:
    show_a_room(page.server)
    ended = threading.Event()
    threading.Thread(target=flood, args=(page, ended), daemon=True).start()
    try:
        with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as tab:
            tab.wait_for("document.querySelectorAll('#tables button').length === 2")
            assert not tab.evaluate(SHOWN)
            network.mode = "slow"
            tab.wait_for(SHOWN)
            for _ in range(40):
                assert tab.evaluate(AGE) < OLDEST
                tab.evaluate("new Promise((done) => setTimeout(done, 200))")
            tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
            assert isinstance(page.next_command(), Stop)
            network.mode = "pass"
            tab.wait_for(f"!({SHOWN})")
    finally:
        ended.set()

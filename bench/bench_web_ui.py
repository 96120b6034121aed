"""Bytes, repaints, frames and first pictures of the web UI of a simulated robot, in headless Chromium.

For a phone (390 x 844) and a laptop (1440 x 900), in 2-D: kB/s to the browser and repaints of the map per second
while the robot stands and while it drives; the longest time between two repaints; and in how many loads with an
empty cache the whole map is drawn at once, with the time that takes. The computer simulates, serves and draws
without a GPU, all at once.

Run: python bench/bench_web_ui.py [--loads 50] [--seconds 20]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.ui.chromium import NO_GPU, Tab, open_tab  # noqa: E402
from tests.ui.faulty_network import FaultyNetwork  # noqa: E402
from tests.ui.test_first_view import DRAWN_AREA  # noqa: E402

PORT = 18421
SIZES = {"phone": (390, 844), "laptop": (1440, 900)}
COUNT_REPAINTS = """window.repaints = [];
const clear = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.id === 'canvas') repaints.push(performance.now() / 1000);
  return clear.apply(this, box);
};"""
SHOWN = f"document.querySelectorAll('#places button').length > 0 && JSON.parse({DRAWN_AREA})[1] > 0"
WHOLE_MAP = "document.getElementById('fit').click()"
SETTLE, STANDS = 3.0, 15.0
"""Time in which a robot that has a goal drives off; time at standstill after which it has none, s."""


class Traffic(NamedTuple):
    """What a page receives and draws: kB/s, repaints per second, and the longest time between two, s."""

    rate: float
    repaints: float
    gap: float


@contextlib.contextmanager
def robot(folder: Path) -> Iterator[None]:
    """Run a robot that delivers in a hotel until the block ends."""
    state = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "CHEFBOT_STATE": str(folder / "state")}
    chefbot = [sys.executable, "-m", "chefbot"]
    world = folder / "hotel.yaml"
    subprocess.run(
        [*chefbot, "world", "generate", "hotel", "--seed", "2", "--out", world], env=state, check=True
    )
    launch = [
        "launch",
        "waiter",
        f"world:={world}",
        f"map_file:={folder / 'hotel.map.yaml'}",
        f"port:={PORT}",
    ]
    with (folder / "launch.log").open("w") as log:
        process = subprocess.Popen([*chefbot, *launch], env=state, stdout=log, stderr=subprocess.STDOUT)
        try:
            if not _serves(process):
                raise SystemExit(f"the launch has ended: {(folder / 'launch.log').read_text()}")
            yield
        finally:
            process.terminate()
            process.wait()


def _serves(process: subprocess.Popen[bytes]) -> bool:
    """Wait until the web UI is there; return False if the launch ends before."""
    while process.poll() is None:
        with contextlib.suppress(OSError), urllib.request.urlopen(f"http://127.0.0.1:{PORT}/", timeout=5.0):
            return True
        time.sleep(0.2)
    return False


def traffic(tab: Tab, network: FaultyNetwork, seconds: float) -> Traffic:
    """Measure what a page receives and draws for `seconds` from now on."""
    tab.evaluate("repaints.length = 0")
    before, began = network.received, time.monotonic()
    time.sleep(seconds)
    passed = time.monotonic() - began
    times = np.array(tab.evaluate("repaints"))
    gap = float(np.diff(times).max()) if len(times) > 1 else np.inf
    return Traffic((network.received - before) / passed / 1e3, len(times) / passed, gap)


def report_traffic(network: FaultyNetwork, name: str, seconds: float) -> None:
    """Print what a page of one size receives and draws while the robot stands, and while it drives."""
    with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as tab:
        tab.resize(*SIZES[name])
        tab.wait_for(SHOWN)
        tab.evaluate(COUNT_REPAINTS)
        _wait_until_it_stands(tab)
        places = tab.evaluate(
            "[...document.querySelectorAll('#places button')].map((one) => one.textContent)"
        )
        for doing in ("stands", "drives"):
            if doing == "drives":
                tab.evaluate(f"document.querySelectorAll('#places button')[{len(places) - 1}].click()")
                time.sleep(SETTLE)
            found = traffic(tab, network, seconds)
            print(
                f"{name:>7} {doing:>7} {found.rate:10.1f} {found.repaints:10.1f} {found.gap:10.2f}",
                flush=True,
            )
        home = places.index("Home")
        tab.evaluate(f"document.querySelectorAll('#places button')[{home}].click()")
        _wait_until_it_stands(tab)


def _wait_until_it_stands(tab: Tab) -> None:
    """Wait until the robot has stood for some seconds: at the start it turns and drives until it is localized."""
    stood = time.monotonic()
    while time.monotonic() - stood < STANDS:
        time.sleep(0.2)
        if tab.evaluate("document.getElementById('speed').textContent") != "0.00 m/s":
            stood = time.monotonic()


def report_loads(network: FaultyNetwork, name: str, loads: int) -> None:
    """Print in how many loads the first picture is that of the whole map, and the time to it."""
    right, times = 0, []
    for _ in range(loads):
        with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as tab:
            tab.resize(*SIZES[name])
            tab.call("Network.setCacheDisabled", cacheDisabled=True)
            began = time.monotonic()
            tab.reload_by("location.reload()")
            tab.wait_for(SHOWN)
            times.append(time.monotonic() - began)
            first = json.loads(tab.evaluate(DRAWN_AREA))
            tab.evaluate(WHOLE_MAP)
            time.sleep(0.2)
            right += bool(np.allclose(first, json.loads(tab.evaluate(DRAWN_AREA)), atol=0.02))
    median, longest = float(np.median(times)), max(times)
    print(
        f"{name:>7}: {right} of {loads} first pictures right; {median:.2f} s, at most {longest:.2f} s",
        flush=True,
    )


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--loads", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder, robot(Path(folder)):
        network = FaultyNetwork(PORT)
        print(f"{'':>15} {'kB/s':>10} {'repaints/s':>10} {'longest gap, s':>10}")
        for name in SIZES:
            report_traffic(network, name, options.seconds)
        for name in SIZES:
            report_loads(network, name, options.loads)
        network.close()


if __name__ == "__main__":
    main()

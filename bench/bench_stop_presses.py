"""Presses of STOP in a browser through a network that delays, loses, resets or refuses its connections at random.

A browser is connected to the web UI of a robot with a drive base (wall time) by a proxy. At each press a fault holds
for 0 to 2 s; some begin just before the press, some just after it. For each fault: presses; lost ones, which the base
never got and the page did not show as unconfirmed; presses that the page showed as confirmed before the base had
stopped; and the time from when data can pass again to when the base has stopped. After a lost or reset connection
that time includes a new one. The last column is the time from the press to the alarm on the page, of the presses that
were not confirmed within it (wanted: 0.3 s). All are wall times, which other load prolongs.

Run: python bench/bench_stop_presses.py [PRESSES] [SEED]
"""

from __future__ import annotations

import os
import random
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.two_web_uis import Robot  # noqa: E402
from tests.ui.chromium import NO_GPU, open_tab  # noqa: E402
from tests.ui.faulty_network import FaultyNetwork  # noqa: E402
from tests.ui.test_stop_under_network_faults import ALARM, STOP, Phone  # noqa: E402

FAULTS = ("none", "late", "hole", "reset", "refused", "answers lost")
MAX_DURATION, MAX_LEAD = 2.0, 0.3
"""Longest fault, and longest time by which a fault begins before the press, s."""
PATIENCE = 30.0
"""Time after which a press counts as lost, s."""
PRESS = "document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))"


class Press(NamedTuple):
    """One press: whether it was lost or confirmed too early, and its times, s (NaN: does not apply)."""

    lost: bool
    early: bool
    stand: float
    alarm: float


def begin(network: FaultyNetwork, fault: str) -> None:
    """Begin a fault of the network."""
    if fault in ("late", "hole", "refused", "answers lost"):
        network.mode, network.delay = fault, 0.5
    if fault in ("reset", "refused"):
        network.reset()


def press(phone: Phone, fault: str, rng: random.Random) -> Press:
    """Press STOP during a fault, end it, and wait until the base has stopped and the page shows it."""
    tab, network = phone.tab, phone.network
    before, duration = rng.random() < 0.5, rng.uniform(0.0, MAX_DURATION)
    if before:
        begin(network, fault)
        time.sleep(rng.uniform(0.0, MAX_LEAD))
    pressed = time.monotonic()
    shown = tab.evaluate(f"{PRESS}, {STOP}")
    if not before:
        begin(network, fault)
    alarm, early = float("nan"), shown == "STOPPED" and not phone.stopped
    while (now := time.monotonic()) - pressed < duration:
        text, raised = tab.evaluate(f"[{STOP}, {ALARM}]")
        early = early or (text == "STOPPED" and not phone.stopped)
        if raised and np.isnan(alarm):
            alarm = now - pressed
        time.sleep(0.01)
    network.mode = "pass"
    # bytes that are late pass at the end of their delay
    passed = max(time.monotonic(), pressed + network.delay if fault == "late" else 0.0)
    while not phone.stopped and time.monotonic() - passed < PATIENCE:
        time.sleep(0.002)
    stand = max(0.0, time.monotonic() - passed)
    lost = not phone.stopped and tab.evaluate(STOP) != "STOP: not confirmed"
    tab.wait_for(f"{STOP} === 'STOPPED' && !({ALARM})")
    return Press(lost, early, stand, alarm)


def print_table(presses: dict[str, list[Press]]) -> None:
    """Print a line for each fault."""
    print(
        f"{'fault':14}{'presses':>8}{'lost':>6}{'early':>7}{'stands after, median':>22}{'p95':>8}{'max':>8}",
        end="",
    )
    print(f"{'alarm after, median':>22}{'max':>8}")
    for fault, rows in sorted(presses.items()):
        stand = np.array([row.stand for row in rows])
        alarms = np.array([row.alarm for row in rows if not np.isnan(row.alarm)])
        raised = (np.median(alarms), alarms.max()) if alarms.size else (float("nan"),) * 2
        print(
            f"{fault:14}{len(rows):8}{sum(row.lost for row in rows):6}{sum(row.early for row in rows):7}"
            f"{np.median(stand):20.3f} s{np.quantile(stand, 0.95):6.2f} s{stand.max():6.2f} s"
            f"{raised[0]:20.2f} s{raised[1]:6.2f} s"
        )


def main() -> None:
    """Press as often as given (1,000), with the seed given (1)."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rng = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    robot = Robot(base=True)
    network = FaultyNetwork(urlsplit(robot.system.nodes["here"].url).port or 0)  # type: ignore[attr-defined]
    presses: dict[str, list[Press]] = defaultdict(list)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    try:
        with open_tab(f"http://127.0.0.1:{network.port}/", NO_GPU) as tab:
            tab.wait_for("!document.body.classList.contains('offline')")
            phone = Phone(tab, network, robot)
            for number in range(count):
                if number % 50 == 0:
                    print(f"{number} of {count} presses", flush=True)
                fault = rng.choice(FAULTS)
                presses[fault].append(press(phone, fault, rng))
                phone.release()
    finally:
        network.close()
        robot.stop()
        print_table(presses)  # also of a run that was interrupted


if __name__ == "__main__":
    main()

"""Contacts of robots that somebody drives without looking, with boxes set down and faults of sensors.

The tables: dropped boxes per robot and fault (contacts, fastest, of drives), and random teleoperation per robot.

Run: python bench/bench_monitored_drives.py [boxes | teleop | stop] [COUNT] [FIRST_SEED] [ROBOT ...]
Seeds go up in steps of 2.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from tests.chaos.monitored_drive import (  # noqa: E402
    ALL_ROBOTS,
    CREEP,
    FAULTS,
    PLACES,
    MonitoredDrive,
    can_know,
    dropped_box,
    main_sensor,
    random_teleop,
    request_of,
)
from tests.chaos.sensor_fault_drive import straight_free_starts  # noqa: E402

from chefbot.robot.motion_limits import Limits  # noqa: E402
from chefbot.robot.spec import Robot  # noqa: E402

WORLDS = ("hotel", "workshop", "room")


def chosen() -> dict[str, Robot]:
    """Return the robots that the command names, all if it names none."""
    return {name: robot for name, robot in ALL_ROBOTS.items() if name in sys.argv[4:] or len(sys.argv) <= 4}


def boxes(count: int, first: int) -> None:
    """Print for each robot and fault contacts over 0.05 m/s, all contacts, the fastest one, and first reasons.

    Contacts with what no sensor of the robot measures are in a column of their own.
    """
    print(
        f"{'robot':15}{'fault':22}{'drives':>7}{'> 0.05':>7}{'any':>5}{'unseen':>7}{'fastest':>9}  first reasons"
    )
    for name, robot in chosen().items():
        for fault in FAULTS:
            if fault != "none" and not request_of(fault, robot):
                continue
            runs = []
            for k in range(count):
                seed = first + 2 * k
                at = straight_free_starts("hotel", 1, seed)[0]
                runs += [(place, dropped_box(robot, at, fault, place, seed)) for place in PLACES]
            known = [run for place, run in runs if can_know(robot, fault, place)]
            hits = sum(run.contact > CREEP for run in known)
            touched = sum(run.contact > 0.0 for run in known)
            touches = [(place, run.touched) for place, run in runs if run.contact > 0.0]
            fastest = max(run.contact for _, run in runs)
            reasons = " | ".join(dict.fromkeys(text[:70] for _, run in runs for text in run.reasons[:2]))[
                :150
            ]
            counts = f"{len(runs):7}{hits:7}{touched:5}{len(touches) - touched:7}{fastest:9.3f}"
            print(f"{name:15}{fault:22}{counts}  {touches or ''} {reasons}", flush=True)


def teleop(count: int, first: int) -> None:
    """Print for each robot and world the contacts and the metres of random teleoperation."""
    print(f"{'robot':15}{'world':10}{'drives':>7}{'contacts':>9}{'metres':>9}")
    for name, robot in chosen().items():
        for world in WORLDS:
            runs = [random_teleop(robot, world, first + 2 * k) for k in range(count)]
            bad = [
                (first + 2 * k, run.contact, run.touched) for k, run in enumerate(runs) if run.contact > 0.0
            ]
            metres = sum(run.metres for run in runs)
            print(f"{name:15}{world:10}{count:7}{len(bad):9}{metres:9.1f}  {bad or ''}", flush=True)


def stop(count: int, first: int) -> None:
    """Print the time from the moment at which a sensor stops to wheels at zero, for teleoperation at full speed."""
    print(f"{'robot':15}{'stops':>7}{'median, ms':>12}{'p99, ms':>9}{'worst, ms':>11}")
    for name, robot in chosen().items():
        rng, times = np.random.default_rng(first), []
        at = straight_free_starts("hotel", 1, first)[0]
        drive = MonitoredDrive(robot, at)
        for _ in range(count):
            drive.hold(0.3 * Limits.of(robot).speed, 0.0, 0.4)
            drive.run(float(rng.uniform(0.0, 0.1)))
            began, start = drive.loop.now_ns, len(drive.wheels)
            drive.request_fault(f"stop {main_sensor(robot)}")
            drive.hold(0.3 * Limits.of(robot).speed, 0.0, 0.6)
            times.append(next((t - began) / 1e6 for t, speed in drive.wheels[start:] if speed == 0.0))
            drive.request_fault("none")
            drive.run(1.0)
            drive.simulation.kidnap(at)
            drive.run(0.3)
        median, p99 = np.percentile(times, (50, 99))
        print(f"{name:15}{count:7}{median:12.0f}{p99:9.0f}{max(times):11.0f}", flush=True)
        drive.system.stop()


if __name__ == "__main__":
    what = sys.argv[1] if len(sys.argv) > 1 else "boxes"
    {"boxes": boxes, "teleop": teleop, "stop": stop}[what](
        int(sys.argv[2]) if len(sys.argv) > 2 else 2, int(sys.argv[3]) if len(sys.argv) > 3 else 1
    )

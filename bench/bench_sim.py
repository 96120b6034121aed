"""Speed of the simulator: physics, sensors and images, in CPU time of the calling thread.

Run: python bench/bench_sim.py
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from functools import partial

import msgspec

from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.board import EXCHANGE_PERIOD_NS, SimulatedBoard
from chefbot.sim.cameras.depth_camera import DepthRenderer
from chefbot.sim.simulation import STEP_NS, Simulation
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
SIZES = ((160, 120), (320, 240), (640, 480))


def measure(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Return (median, minimum) seconds of one call; the first is not counted."""
    work()
    times = []
    for _ in range(repeats):
        begun = time.thread_time()
        work()
        times.append(time.thread_time() - begun)
    return statistics.median(times), min(times)


def print_physics() -> None:
    """Print simulated time divided by CPU time while the robot drives in circles."""
    print(f"{'physics':34}{'solids':>8}{'RTF median':>12}{'best':>8}")
    for name, people in (("empty", 0), ("room", 0), ("hotel", 0), ("hotel", 3), ("hotel", 8)):
        sim = Simulation(ROBOT, load_world(name), "real", 1, people=people)
        sim.set_duty(0.3, 0.5)

        def one_second(sim: Simulation = sim) -> None:
            for _ in range(1_000_000_000 // STEP_NS):
                sim.step()

        median, minimum = measure(one_second, 15)
        label = f"{name}, {people} people"
        print(f"{label:34}{len(sim.world.static):8}{1 / median:12.0f}{1 / minimum:8.0f}")


def print_board() -> None:
    """Print the speed with firmware, serial link and messages."""
    sim = Simulation(ROBOT, load_world("hotel"), "real", 1)
    board = SimulatedBoard(ROBOT, sim)

    def one_second() -> None:
        for _ in range(1_000_000_000 // EXCHANGE_PERIOD_NS):
            board.command(0.2 / ROBOT.wheel_radius, 0.25 / ROBOT.wheel_radius)
            board.run_until(board.now_ns + EXCHANGE_PERIOD_NS)

    median, minimum = measure(one_second, 15)
    print(f"{'with board, link and ultrasonic':34}{'':8}{1 / median:12.0f}{1 / minimum:8.0f}")


def print_sensors() -> None:
    """Print the ms of one reading in the dining room of the hotel."""
    print(f"\n{'sensor, hotel':34}{'median ms':>12}{'min ms':>8}")
    sim = Simulation(ROBOT, load_world("hotel"), "real", 1, start=SE2(3.9, 2.8, 0.1), people=3)
    readings: dict[str, Callable[[], object]] = {
        "lidar, 360 beams": sim.lidar,
        "ultrasonic, 61 rays": sim.ultrasonic,
        "imu": sim.imu,
        "camera capture": sim.capture,
    }
    for name, reading in readings.items():
        median, minimum = measure(reading, 100)
        print(f"{name:34}{median * 1e3:12.3f}{minimum * 1e3:8.3f}")


def print_pictures() -> None:
    """Print the ms of one image: median and maximum over all places of the hotel."""
    print(
        f"\n{'depth frame, hotel, all places':34}{'render':>8}{'slowest':>9}{'measure':>9}{'colour':>8}  (ms)"
    )
    hotel, camera = load_world("hotel"), ROBOT.sensors.depth_camera
    assert camera is not None
    captures = [Simulation(ROBOT, hotel, start=place).capture() for place in hotel.places.values()]
    for width, height in SIZES:
        renderer = DepthRenderer(msgspec.structs.replace(camera, width=width, height=height), "real", 1)
        renders = [measure(partial(renderer.render, capture), 15)[0] * 1e3 for capture in captures]
        exact = renderer.render(captures[0])
        spoil = measure(partial(renderer.measure, exact, 1), 15)[0] * 1e3
        colour = measure(partial(renderer.render_rgb, captures[0], exact), 15)[0] * 1e3
        label = f"{width} x {height}"
        print(f"{label:34}{statistics.median(renders):8.2f}{max(renders):9.2f}{spoil:9.2f}{colour:8.2f}")


def main() -> None:
    """Print all tables."""
    print(f"one core used, {os.cpu_count()} present, load {os.getloadavg()[0]:.1f}\n")
    print_physics()
    print_board()
    print_sensors()
    print_pictures()


if __name__ == "__main__":
    main()

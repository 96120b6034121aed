"""Depth image to scan: time per image beside ROS's depthimage_to_laserscan (C++, -O2, measured separately)."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np

from chefbot.robot.section import Mount
from chefbot.scan.camera import CameraModel
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.scan.drop_offs import FloorLimits
from chefbot.scan.obstacle_scan import ObstacleScanner, ObstacleScanParams

CPP_US = {1: (13.7, 13.1), 10: (157.0, 153.0), 100: (1360.0, 1290.0), 478: (6300.0, 6000.0)}


def microseconds(call: Callable[[], object], repeats: int = 300) -> tuple[float, float]:
    """Return median and minimum process time of a call, after one warm-up call."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append((time.perf_counter() - begin) * 1e6)
    return float(np.median(times)), min(times)


def camera(width: int, height: int) -> CameraModel:
    f = 570.34 * width / 640
    return CameraModel(width, height, f, f, (width - 1) / 2, (height - 1) / 2, 0.45, 8.0)


def main() -> None:
    rng = np.random.default_rng(0)
    print(f"one core of {os.cpu_count()}; us per image: median (min) | C++ median | ratio of medians")
    millimetres = rng.integers(0, 9000, (480, 640)).astype(np.uint16)
    for height, figures in CPP_US.items():
        convert = DepthToScan(camera(640, 480), DepthToScanParams(scan_height=height)).convert
        images = {"16UC1": millimetres, "32FC1": (millimetres * 0.001).astype(np.float32)}
        for (name, image), cpp in zip(images.items(), figures, strict=True):
            median, minimum = microseconds(lambda c=convert, i=image: c(i))  # type: ignore[misc]
            ours = f"to scan 640x480 {name} height {height:3d}: {median:7.1f} ({minimum:7.1f})"
            print(f"{ours} | {cpp:7.1f} | {cpp / median:5.1f}")
    for width, height in ((160, 120), (320, 240), (640, 480)):
        scanner = ObstacleScanner(
            camera(width, height),
            Mount(x=0.09, z=0.3, pitch=0.0),
            0.6,
            FloorLimits(0.105, 0.06, 0.0018),
            ObstacleScanParams(),
        )
        image = rng.integers(0, 9000, (height, width)).astype(np.uint16)
        median, minimum = microseconds(lambda s=scanner, i=image: s.scan(i))  # type: ignore[misc]
        print(f"obstacles {width}x{height} 16UC1, random depths: {median:7.1f} ({minimum:7.1f})")


if __name__ == "__main__":
    main()

"""Draws the animated picture of the landing page: `python docs/animation.py LOG.mcap docs/pictures/driving.webp`.

`chefbot launch explore world:=hotel robot:=chefbot_lidar headless:=true speed:=0 record:=LOG.mcap` makes the log.
"""

from __future__ import annotations

import sys
from bisect import bisect_right
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.msgs.nav_msgs import Path as PlannedPath
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.runtime.recorded_log import read_log

PERIOD, FRAME_MS = 2.5, 90
"""Simulated time between two frames, s, and time that each is shown, ms."""
SCALE, SUPERSAMPLING = 34.0, 2
"""Pixels a metre, and how much larger frames are drawn before they are reduced."""
UNKNOWN, FREE, OCCUPIED = (208, 213, 219), (255, 255, 255), (36, 41, 47)
SCAN, PLAN, ROBOT, TRAIL = (31, 111, 235), (26, 127, 55), (207, 34, 46), (232, 113, 10)


class Track(NamedTuple):
    """The messages of one topic in order of time."""

    times: list[float]
    messages: list[Any]

    def latest(self, time: float) -> Any:
        """Return the last message up to a time in s, or None before the first."""
        index = bisect_right(self.times, time)
        return self.messages[index - 1] if index else None


def tracks(path: Path) -> tuple[dict[str, Track], float]:
    """Return the decoded topics of a log, and its robot's radius in m."""
    log = read_log(path)
    kinds = {"map": OccupancyGrid, "ground_truth": Odometry, "scan": LaserScan, "plan": PlannedPath}
    found = {topic: Track([], []) for topic in kinds}
    for message in log.messages:
        if message.topic in kinds:
            found[message.topic].times.append(message.time_ns / 1e9)
            found[message.topic].messages.append(kinds[message.topic].from_cdr(message.data))
    return found, log.robot.circumscribed_radius


class Canvas:
    """A window of the map frame in pixels."""

    def __init__(self, last: Grid) -> None:
        known = np.argwhere(last.cells >= 0)
        (bottom, left), (top, right) = known.min(axis=0) - 4, known.max(axis=0) + 4
        self.left = last.origin_x + left * last.resolution
        self.top = last.origin_y + top * last.resolution
        self.scale = SCALE * SUPERSAMPLING
        self.size = (
            int((right - left) * last.resolution * self.scale),
            int((top - bottom) * last.resolution * self.scale),
        )

    def pixels(self, points: NDArray[np.float64]) -> list[tuple[float, float]]:
        """Return points (n, 2) in m as pixels."""
        return [((x - self.left) * self.scale, (self.top - y) * self.scale) for x, y in points]

    def background(self, grid: Grid) -> Image.Image:
        """Return the map in the window."""
        colours = np.array([UNKNOWN, FREE, OCCUPIED], np.uint8)
        kind = np.where(grid.cells < 0, 0, np.where(grid.cells > 50, 2, 1))
        image = Image.fromarray(colours[kind[::-1]])
        size = (
            round(grid.width * grid.resolution * self.scale),
            round(grid.height * grid.resolution * self.scale),
        )
        canvas = Image.new("RGB", self.size, UNKNOWN)
        (corner,) = self.pixels(np.array([[grid.origin_x, grid.origin_y + grid.height * grid.resolution]]))
        canvas.paste(image.resize(size, Image.Resampling.NEAREST), (round(corner[0]), round(corner[1])))
        return canvas


def frame(canvas: Canvas, found: dict[str, Track], time: float, radius: float) -> Image.Image:
    """Draw map, scan, plan, driven path and robot at one time."""
    image = canvas.background(found["map"].latest(time).grid)
    pen = ImageDraw.Draw(image, "RGBA")
    pose: SE2 = found["ground_truth"].latest(time).pose.pose.se2
    _draw_scan(pen, canvas, found["scan"].latest(time), pose)
    poses = found["ground_truth"]
    path = np.array(
        [
            [m.pose.pose.se2.x, m.pose.pose.se2.y]
            for m in poses.messages[: bisect_right(poses.times, time) : 5]
        ]
    )
    if len(path) > 1:
        pen.line(canvas.pixels(path), fill=(*TRAIL, 150), width=3)
    plan = found["plan"].latest(time)
    if plan is not None and len(plan.poses) > 1:
        pen.line(
            canvas.pixels(np.array([[p.pose.se2.x, p.pose.se2.y] for p in plan.poses])),
            fill=(*PLAN, 255),
            width=5,
        )
    ((x, y), tip) = canvas.pixels(np.array([[pose.x, pose.y], pose.apply(np.array([[radius, 0.0]]))[0]]))
    r = radius * canvas.scale
    pen.ellipse((x - r, y - r, x + r, y + r), fill=(255, 255, 255, 230), outline=ROBOT, width=5)
    pen.line([(x, y), tip], fill=ROBOT, width=5)
    return image.resize(
        (image.width // SUPERSAMPLING, image.height // SUPERSAMPLING), Image.Resampling.LANCZOS
    )


def _draw_scan(pen: ImageDraw.ImageDraw, canvas: Canvas, scan: LaserScan, pose: SE2) -> None:
    """Shade the area that the last scan saw."""
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, scan.range_max)
    ends = np.stack([ranges * np.cos(scan.angles), ranges * np.sin(scan.angles)], axis=1)
    pen.polygon(canvas.pixels(pose.apply(ends)), fill=(*SCAN, 45))


def main() -> None:
    """Write the animation named on the command line."""
    found, radius = tracks(Path(sys.argv[1]))
    canvas = Canvas(found["map"].messages[-1].grid)
    end = found["ground_truth"].times[-1]
    start = found["map"].times[0]
    frames = [frame(canvas, found, time, radius) for time in np.arange(start, end, PERIOD)]
    durations = [FRAME_MS] * (len(frames) - 1) + [2500]
    first, *others = frames
    first.save(
        sys.argv[2], save_all=True, append_images=others, duration=durations, loop=0, quality=60, method=4
    )


if __name__ == "__main__":
    main()

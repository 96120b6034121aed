"""Tests in Chromium of the drawn map: outlines of walls, labels, the robot, and no drawing without a change."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from tests.support.waiting import wait_for
from tests.support.web_ui import MAP_SHOWN, show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab, pixels

from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.robot.load import load_robot
from chefbot.ui.delivery_view import delivery_view
from chefbot.ui.display.robot_view import shape_view
from chefbot.ui.display.views import RobotView, StatusView
from chefbot.ui.layers import LAYERS

LOOPS = """(async (grids) => {
  const { regionLoops, straightened } = await import('./outlines.js');
  const result = grids.map((grid) => {
    const loops = regionLoops(grid, (value) => value === 100);
    return [loops, loops.map(straightened)];
  });
  return JSON.stringify(result);
})(%s)"""
LABELS = """(async (points, scale) => {
  const { Labels } = await import('./labels.js');
  const view = { width: 800, height: 600, scale }, labels = new Labels(canvas.getContext('2d'), view);
  points.forEach(([x, y], i) => labels.write(`Table ${i}`, x, y, '#000'));
  return JSON.stringify(labels.taken.map((box) => [box.left, box.right, box.top, box.bottom]));
})(%s, %s)"""
LABEL_IN_ITS_ROOM = """(async () => {
  const { Labels } = await import('./labels.js');
  const view = { width: 800, height: 600, scale: 40 }, wall = (x, y) => (y < 300 ? 1 : 2);
  const labels = new Labels(canvas.getContext('2d'), view, wall);
  labels.write('Table 1', 400, 310, '#000');
  labels.write('Table 2', 400, 290, '#000');
  return JSON.stringify(labels.taken.map((box) => [box.top, box.bottom]));
})()"""
DARK_GREY = pixels(40, 40, 40)
"""Number of pixels in the colour that walls have in pictures of maps, but not as outlines."""
DRAWN = "canvas.getContext('2d').getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data[3] === 255"
EMPTY_AFTER_RESIZE = f"""(async () => {{
  const answer = new Promise((resolve) => {{
    let seen = 0;                        // the first time when it begins to observe
    new ResizeObserver(() => {{ if (seen++) resolve(!({DRAWN})); }}).observe(canvas);
  }});
  for (const _ of [1, 2, 3]) await new Promise(requestAnimationFrame);
  document.querySelector('header').style.paddingBlock = '30px';
  return answer;
}})()"""
"""Whether the map is empty in the frame in which its size changes."""
COUNT_PAINTS = """(() => {
  window.paints = 0;
  const clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.clearRect = function (...area) { window.paints += 1; clear.apply(this, area); };
})()"""


def paints(tab: Tab, seconds: float) -> int:
    """Return how often the map is drawn in this time, counted from its begin."""
    tab.evaluate("window.paints = 0")
    time.sleep(seconds)
    return int(tab.evaluate("window.paints"))


def loops_of(tab: Tab, masks: list[np.ndarray]) -> list[Any]:
    """Return the outlines of the True cells of each mask, and the straightened ones."""
    grids = [
        {"width": mask.shape[1], "height": mask.shape[0], "cells": (100 * mask).ravel().tolist()}
        for mask in masks
    ]
    answer: list[Any] = json.loads(tab.evaluate(LOOPS % json.dumps(grids)))
    return answer


def area(loops: list[list[list[float]]]) -> float:
    """Return the area inside of loops, cells; that of holes is negative."""
    total = 0.0
    for loop in loops:
        x, y = np.array(loop, float).T
        total += 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    return total


def distances_to_outlines(points: np.ndarray, loops: list[np.ndarray]) -> np.ndarray:
    """Return the distance of each point (n, 2) to the nearest edge, cells."""
    begin = np.concatenate(loops)
    along = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops]) - begin
    offset = points[:, None] - begin
    share = np.clip((offset * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    gaps: np.ndarray = np.linalg.norm(share[..., None] * along - offset, axis=2)
    return gaps.min(axis=1)


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    from tests.ui.conftest import Page

    page = Page()
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as opened:
        yield opened
    page.server.stop()


@pytest.mark.slow
@needs_chromium
def test_outlines_enclose_exactly_the_cells(tab: Tab) -> None:
    rng = np.random.default_rng(3)
    masks = [
        rng.random((int(h), int(w))) < share for h, w in rng.integers(1, 30, (40, 2)) for share in (0.2, 0.7)
    ]
    for mask, (loops, _) in zip(masks, loops_of(tab, masks), strict=True):
        assert area(loops) == mask.sum()
        corners = [tuple(corner) for loop in loops for corner in loop]
        assert all(0 <= x <= mask.shape[1] and 0 <= y <= mask.shape[0] for x, y in corners)


@pytest.mark.slow
@needs_chromium
def test_straightened_outlines_stay_near_the_cells(tab: Tab) -> None:
    rng = np.random.default_rng(5)
    rows, columns = np.mgrid[0:60, 0:60]
    slanted = np.abs(columns - 0.37 * rows - 20.0) < 1.5
    noisy = (columns == 10) | ((columns == 11) & (rng.random((60, 60)) < 0.3))
    ring = np.zeros((60, 60), bool)
    ring[5:55, 5:55], ring[6:54, 6:54] = True, False
    answers = loops_of(tab, [slanted, noisy, ring, rng.random((60, 60)) < 0.3])
    for loops, straight in answers:
        outlines = [np.array(loop, float) for loop in straight]
        corners = np.array([corner for loop in loops for corner in loop], float)
        assert distances_to_outlines(corners, outlines).max() <= 1.0 + 0.71 + 0.6
        assert all(len(loop) >= 4 for loop in straight)
    slanted_loops, slanted_straight = answers[0]
    assert sum(map(len, slanted_straight)) < 0.2 * sum(map(len, slanted_loops))
    assert sorted(map(len, answers[2][1])) == [4, 4]


@pytest.mark.slow
@needs_chromium
def test_no_label_covers_another_and_far_away_there_are_none(tab: Tab) -> None:
    points = np.random.default_rng(7).uniform((0, 0), (800, 600), (120, 2)).round(1).tolist()
    boxes = json.loads(tab.evaluate(LABELS % (points, 40)))
    assert len(boxes) > 40
    for i, (left, right, top, bottom) in enumerate(boxes):
        assert left >= 0 and right <= 800 and top >= 0 and bottom <= 600
        for other in boxes[:i]:
            assert right <= other[0] or other[1] <= left or bottom <= other[2] or other[3] <= top
    assert json.loads(tab.evaluate(LABELS % (points, 4))) == []


def test_labels_are_in_the_rooms_of_their_places(tab: Tab) -> None:
    """Two tables stand on both sides of a wall."""
    below, above = json.loads(tab.evaluate(LABEL_IN_ITS_ROOM))
    assert below[0] > 310 and above[1] < 290


@pytest.mark.slow
@needs_chromium
def test_nothing_is_drawn_while_nothing_on_the_map_changes(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(MAP_SHOWN)
        tab.evaluate(COUNT_PAINTS)
        wait_for(lambda: paints(tab, 1.0) == 0, "the first view to be complete")
        tab.wait_for("performance.now() > 3500")  # the time that the page waits for a map at most
        assert tab.evaluate("window.paints") == 0
        for i in range(20):
            page.server.set_layer("status", StatusView(phase="Waiting for an order.", clock=float(i)))
            page.server.set_layer("joints", {"left": 0.1 * i})
            page.server.set_layer("particles", np.full((5, 3), 0.01 * i))  # hidden at first
            time.sleep(0.1)
        tab.wait_for("document.getElementById('clock').textContent !== ''")
        assert tab.evaluate("window.paints") == 0
        page.server.set_layer("robot", RobotView(x=1.2, y=1.0, yaw=0.0))
        tab.wait_for("window.paints > 0")


@pytest.mark.slow
@needs_chromium
def test_a_map_with_very_many_corners_is_a_picture(page: Any) -> None:
    noise = np.random.default_rng(1).choice([0, 100], (500, 500)).astype(np.int8)
    for cells, is_picture in [(noise, True), (np.where(np.eye(300) > 0, 100, 0).astype(np.int8), False)]:
        page.server.set_layer("map", Grid(cells, 0.05, 0.0, 0.0))
        with open_tab(page.url, NO_GPU) as tab:
            tab.wait_for(f"{DARK_GREY} {'>' if is_picture else '==='} 0 && {DRAWN}")


@pytest.mark.parametrize("name", ["chefbot", "chefbot_lidar", "jackal"])
def test_the_robot_is_described_from_above(name: str) -> None:
    robot = load_robot(name)
    shape = LAYERS["shape"].validate(shape_view(robot))
    assert shape.radius == robot.circumscribed_radius
    assert (len(shape.corners) == 4) == (name == "jackal")
    assert [y for _, y, _, _ in shape.wheels] == [robot.wheels.separation / 2, -robot.wheels.separation / 2]
    assert len(shape.cones) == (robot.sensors.depth_camera is not None)


def test_food_on_the_tray_is_shown() -> None:
    assert delivery_view(DeliveryStatus(state="driving", loaded=True), "").loaded
    assert not delivery_view(DeliveryStatus(state="driving"), "").loaded


@pytest.mark.slow
@needs_chromium
def test_the_map_does_not_flicker_when_its_size_changes(page: Any) -> None:
    show_a_room(page.server)
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(DRAWN)
        assert tab.evaluate(EMPTY_AFTER_RESIZE) is False

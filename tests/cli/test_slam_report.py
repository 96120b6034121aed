"""The report of a SLAM run: its figures, its pictures, and what each scan cost."""

from __future__ import annotations

import base64
import io
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from chefbot.cli.map import slam_costs, slam_report
from chefbot.cli.map.slam_costs import MEMORY_PERIOD, SlamCosts
from chefbot.cli.map.slam_pictures import (
    costs_picture,
    map_picture,
    odometry_picture,
    reduced,
    residuals_picture,
)
from chefbot.cli.map.slam_report import LISTED_CLOSURES, report_page, summary
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.graph import ClosureResidual, GraphSlamParams
from chefbot.slam.no_return import NoReturn
from chefbot.slam.offline import SlamResult
from chefbot.slam.params import GmappingParams


def result_of(closures: int = 3, cells: np.ndarray | None = None) -> SlamResult:
    """Return the result of a square of 4 m with some closures, of which the last has the largest residual."""
    poses = [SE2(0, 0, 0), SE2(4, 0, 0), SE2(4, 4, 0), SE2(0, 4, 0), SE2(0, 0.3, 0)]
    grid = Grid(np.zeros((90, 100), np.int8) if cells is None else cells, 0.05, -1.0, -0.5)
    found = [ClosureResidual(of=k % 4, to=4, linear=0.01 * (k + 1), angular=0.02) for k in range(closures)]
    return SlamResult([0.0] * 5, poses, grid, 12, NoReturn(7.5, 0.25), poses, found, -0.021)


def costs_of(*seconds: float) -> SlamCosts:
    return SlamCosts(list(seconds), [(1, 100.0), (2, 260.0), (3, 180.0)], 1.5)


def picture(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages are made of texts alone."""
    for name in ("map_picture", "odometry_picture", "residuals_picture", "costs_picture"):
        monkeypatch.setattr(slam_report, name, lambda _: b"\x89PNG")


# ---- figures


def test_the_figures_are_those_of_the_run() -> None:
    cells = np.full((40, 60), -1, np.int8)
    cells[:20, :40] = 0
    cells[0] = 100
    figures = summary(result_of(cells=cells), costs_of(0.010, 0.020, 0.5))
    assert figures["Scans"] == "12, 5 of them used"
    assert figures["Length of the trajectory"] == "15.7 m"
    assert figures["Map"] == "3.0 m x 2.0 m, 0.05 m per cell"
    assert figures["Observed area"] == f"{(20 * 40 + 20) * 0.0025:.0f} m²"
    assert figures["Loop closures"] == "3" and figures["Correction of all ranges"] == "-21 mm"
    assert figures["No return"] == "ranges of 7.50 m and more, 25.0% of all beams"
    assert figures["Time"] == "0.5 s for the scans, 1.5 s at the end"
    assert figures["Time of one scan"].startswith("median 20.0 ms, 99th percentile 490.4 ms, longest 500 ms")
    assert figures["Memory of the process"] == "100 MB at the first scan, 260 MB at most"


@pytest.mark.usefixtures("without_pictures")
def test_unknown_values_are_named_or_left_out() -> None:
    result = result_of(closures=0)
    plain = SlamResult(result.stamps, result.poses, result.grid, 12, None, result.odometry)
    figures = summary(plain, SlamCosts([0.01]))
    assert figures["No return"] == "no value stands out" and "Memory of the process" not in figures
    page = report_page(Path("x.log"), GmappingParams(), plain, SlamCosts([0.01]))
    assert "<h2>Loop closures</h2><p>None.</p>" in page


# ---- the page


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("params", [GmappingParams(), GraphSlamParams()])
def test_a_page_has_its_pictures_and_every_parameter(params: GmappingParams | GraphSlamParams) -> None:
    page = report_page(Path("a/<b> & c.log"), params, result_of(), costs_of(0.1, 0.2))
    pictures = re.findall(r"src='data:image/png;base64,([^']+)'", page)
    assert len(pictures) == 4
    assert all(base64.b64decode(one).startswith(b"\x89PNG") for one in pictures)
    algorithm = "gmapping" if isinstance(params, GmappingParams) else "graph"
    assert f"<h1>&lt;b&gt; &amp; c.log, {algorithm}</h1>" in page and "<b>" not in page
    for name in params.__struct_fields__:
        value = getattr(params, name)
        inner = value.__struct_fields__ if hasattr(value, "__struct_fields__") else [""]
        for key in inner:
            assert f"<th>{name}{'.' if key else ''}{key}</th>" in page


@pytest.mark.usefixtures("without_pictures")
def test_the_worst_closures_are_listed_first() -> None:
    page = report_page(
        Path("x.log"), GraphSlamParams(), result_of(closures=LISTED_CLOSURES + 4), costs_of(0.1)
    )
    listed = [float(text) for text in re.findall(r"<td>([\d.]+) cm</td>", page)]
    assert listed == [float(k) for k in range(LISTED_CLOSURES + 4, 4, -1)]
    assert f"The largest of {LISTED_CLOSURES + 4}" in page and f"{math.degrees(0.02):.2f}&deg;" in page


# ---- pictures


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few pixels are drawn quickly."""
    monkeypatch.setattr("chefbot.cli.map.slam_pictures.DPI", 50)


GRIDS = st.tuples(st.integers(1, 9), st.integers(1, 9), st.integers(0, 999)).map(
    lambda t: np.random.default_rng(t[2]).choice(np.array([-1, 0, 40, 100], np.int8), t[:2])
)


@given(GRIDS, st.integers(1, 5))
def test_a_reduced_map_keeps_its_walls(cells: np.ndarray, step: int) -> None:
    small = reduced(cells, step)
    assert small.shape == tuple(math.ceil(side / step) for side in cells.shape) and small.dtype == np.int8
    for (row, column), value in np.ndenumerate(small):
        block = cells[row * step : (row + 1) * step, column * step : (column + 1) * step]
        assert value == block.max()


def test_the_map_is_dark_at_walls_and_red_at_closures() -> None:
    walls = np.zeros((90, 100), np.int8)
    walls[:, :50] = 100
    plain = picture(map_picture(result_of(closures=0, cells=walls)))
    dark = plain.sum(axis=2) < 60
    assert dark.mean() > 0.2 and np.nonzero(dark)[1].mean() < 0.5 * plain.shape[1], "the left half"
    closed = picture(map_picture(result_of(cells=walls)))
    red_plain, red_closed = (
        int((image[..., 0] - image[..., 1:].max(axis=2) > 50).sum()) for image in (plain, closed)
    )
    assert red_plain == 0 and red_closed > 20


@pytest.mark.parametrize("shape", [(1, 1), (4001, 10)])
def test_maps_of_any_shape_are_drawn(shape: tuple[int, int]) -> None:
    image = picture(map_picture(result_of(cells=np.zeros(shape, np.int8))))
    height, width, _ = image.shape
    assert 0.4 <= height / width <= 1.5


def test_the_other_pictures_are_drawn_too() -> None:
    for png in (
        odometry_picture(result_of()),
        residuals_picture(result_of()),
        costs_picture(costs_of(0.1, 0.2)),
    ):
        assert (picture(png).sum(axis=2) < 600).any()
    assert picture(costs_picture(SlamCosts([0.1]))).any(), "without readings of the memory"


# ---- costs


def test_each_scan_has_the_time_since_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0]
    monkeypatch.setattr(slam_costs, "wall_ns", lambda: now[0])
    costs = SlamCosts(_last_ns=0)
    for k in range(1, 2 * MEMORY_PERIOD + 2):
        now[0] += k * 10**7
        costs.add()
    now[0] += 3 * 10**9
    costs.end()
    assert costs.seconds == pytest.approx([0.01 * k for k in range(1, 2 * MEMORY_PERIOD + 2)])
    assert costs.finish_seconds == pytest.approx(3.0)
    if costs.memory:  # on systems with /proc
        counts = [count for count, _ in costs.memory]
        assert counts == [1, MEMORY_PERIOD + 1, 2 * MEMORY_PERIOD + 1, 2 * MEMORY_PERIOD + 1]
        assert all(1.0 < megabytes < 1e6 for _, megabytes in costs.memory)


def test_reading_the_memory_does_not_count_as_time_of_a_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0]
    monkeypatch.setattr(slam_costs, "wall_ns", lambda: now[0])
    costs = SlamCosts(_last_ns=0)
    monkeypatch.setattr(SlamCosts, "_read_memory", lambda _: now.__setitem__(0, now[0] + 10**9))
    for _ in range(3):
        now[0] += 10**7
        costs.add()
    assert costs.seconds == pytest.approx([0.01] * 3)

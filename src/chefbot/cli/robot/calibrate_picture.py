"""Picture of a calibration: return errors before and after, as in UMBmark, and the results."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from chefbot.calibration.calibrate import CalibrationResult
from chefbot.calibration.umbmark import ReturnErrors
from chefbot.cli.robot.calibrate_file import Findings
from chefbot.robot.spec import Robot

BLUE, ORANGE, GREY = "#1f6feb", "#e8710a", "0.55"


def picture(result: CalibrationResult, found: Findings, robot: Robot) -> bytes:
    """Return a PNG with the return errors before and, enlarged, after, and the results with their uncertainty."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    before, after, numbers = figure.subplots(1, 3)
    enlarged = _reach(result.before) / _reach(result.after)
    _returns(before, result.before, "before: by the robot file")
    _returns(after, result.after, f"after, on other squares, {enlarged:.0f} times enlarged")
    _numbers(numbers, found)
    ratio = result.before.worst / max(result.after.worst, 1e-6)
    figure.suptitle(
        f"{robot.name}: systematic error of squares {1000 * result.before.worst:.0f} mm before, "
        f"{1000 * result.after.worst:.1f} mm after ({ratio:.0f} times less)",
        fontsize=11,
    )
    file = io.BytesIO()
    FigureCanvasAgg(figure).print_png(file)
    return file.getvalue()


def _reach(errors: ReturnErrors) -> float:
    """Return the half-width of a plot, mm, with space around all points and for the legend."""
    return 1300.0 * max(float(np.abs(errors.left).max()), float(np.abs(errors.right).max()), 1e-5)


def _returns(axes: Any, errors: ReturnErrors, title: str) -> None:
    """Plot the true final positions relative to those by odometry."""
    for points, colour, name in ((errors.left, BLUE, "to the left"), (errors.right, ORANGE, "to the right")):
        x, y = (points * 1000.0).T
        axes.plot(x, y, "o", color=colour, ms=5, alpha=0.7, label=f"squares {name}")
        axes.plot(x.mean(), y.mean(), "+", color=colour, ms=14, mew=2)
    axes.plot(0.0, 0.0, "x", color=GREY, ms=8, label="odometry")
    reach = _reach(errors)
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=10)
    axes.grid(color="0.9")
    axes.legend(fontsize=8, loc="best")


def _numbers(axes: Any, found: Findings) -> None:
    """Plot the change of each factor in per cent, with its uncertainty."""
    factors = [one for one in found.values if not one.unit]
    for row, one in enumerate(factors):
        off, width = 100.0 * (one.value / one.before - 1.0), 100.0 * one.deviation
        axes.barh(row, off, color=BLUE, height=0.5, xerr=3.0 * width, ecolor="black", capsize=4)
        axes.annotate(
            f"{off:+.3f} +- {width:.3f} %", (0.0, row), xytext=(-5.0 if off > 0.0 else 5.0, 0.0),
            textcoords="offset points", ha="right" if off > 0.0 else "left", va="center", fontsize=8,
        )  # fmt: skip
    others = ", ".join(f"{one.key} {one.text_of(one.value)}" for one in found.values if one.unit)
    axes.set_yticks(range(len(factors)), [one.key for one in factors])
    axes.set(
        xlabel="change from the robot file [%]\n(black: three standard deviations)",
        ylim=(-0.6, len(factors) - 0.2),
    )
    axes.axvline(0.0, color="black", lw=0.8)
    axes.margins(x=0.5)
    axes.set_title(others, fontsize=8)

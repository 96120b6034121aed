"""Picture of the step responses of both wheels."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.board.bring_up import StepResponse
from chefbot.storage.atomic_files import make_folder, write_atomic

COLOURS = {"left": "#1f6feb", "right": "#e8710a"}


class StepCurve(NamedTuple):
    """The step of one wheel: times (n,), s, speeds (n,) and the commanded one, ticks/s."""

    side: str
    times: NDArray[np.float64]
    speeds: NDArray[np.float64]
    target: float
    response: StepResponse


def write_picture(curves: list[StepCurve], path: Path) -> None:
    """Write a PNG with the speeds of both wheels after the step."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    _draw(figure.subplots(), curves)
    file = io.BytesIO()
    FigureCanvasAgg(figure).print_png(file)
    make_folder(path.parent)
    write_atomic(path, file.getvalue())


def _draw(axes: Any, curves: list[StepCurve]) -> None:
    for curve in curves:
        label = f"{curve.side}: 90 % after {curve.response.rise_time:.2f} s"
        axes.plot(curve.times, 100.0 / curve.target * curve.speeds, color=COLOURS[curve.side], label=label)
    axes.axhline(100.0, color="0.6", lw=1)
    axes.set(
        xlabel="time since the command [s]",
        ylabel="speed [% of the commanded]",
        title="Step of the wheel speed",
    )
    axes.grid(color="0.9")
    axes.legend(loc="lower right")

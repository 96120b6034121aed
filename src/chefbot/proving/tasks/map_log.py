"""Task `map_log`: map a recorded log and compare the trajectory with true relations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chefbot.config import read_bytes
from chefbot.errors import ChefbotError, UserError
from chefbot.proving.scenario_tasks import MapLogTask
from chefbot.slam.carmen import parse
from chefbot.slam.offline import run_log
from chefbot.slam.params import MATCH_RANGE, GmappingParams
from chefbot.slam.relations import parse_relations, relation_errors, track_of_log
from chefbot.storage.carmen_log import read_text

MAX_RELATIONS_BYTES = 100_000_000


def map_log(
    task: MapLogTask, seed: int, folder: Path
) -> tuple[dict[str, float], list[tuple[float, float, float]]]:
    """Return the figures of mapping the log, and the path as rows (time s, x m, y m) in the map frame."""
    text, missing = read_text(folder / task.log)
    if missing:
        raise UserError(f"log {task.log}: {missing}")
    records = list(parse(text))
    matched = min(task.max_range, MATCH_RANGE)
    params = GmappingParams(
        particles=task.particles, seed=seed, max_range=task.max_range, match_range=matched
    )
    try:
        result = run_log(records, params)
        track = track_of_log(records, result.stamps, result.poses)
    except ChefbotError as error:
        raise UserError(f"log {task.log}: {error}") from None
    figures = {"time": result.stamps[-1] - result.stamps[0]}
    if task.relations:
        figures["relation_error"] = float(relation_errors(track, _relations(task, folder)).mean())
    path = [(t - result.stamps[0], p.x, p.y) for t, p in zip(result.stamps, result.poses, strict=True)]
    return figures, path


def _relations(task: MapLogTask, folder: Path) -> NDArray[np.float64]:
    """Return the true relations. Raises UserError that names their file."""
    try:
        return parse_relations(read_bytes(folder / task.relations, "relations", MAX_RELATIONS_BYTES).decode())
    except UnicodeDecodeError:
        raise UserError(f"relations {task.relations}: the file is not text") from None
    except ChefbotError as error:
        raise UserError(f"relations {task.relations}: {error}") from None

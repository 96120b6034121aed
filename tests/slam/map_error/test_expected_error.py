"""Poses are as uncertain as the motions between them, unless another pass holds them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from chefbot.slam.map_error.expected_error import expected_std
from chefbot.slam.map_error.keyframes import BINS, POINTS, Keyframes
from chefbot.slam.map_error.view_overlap import Overlaps, overlaps_of

POSES = 12


def line_of(n: int) -> Keyframes:
    """Return keyframes on a line, 1 m apart, that have seen nothing."""
    poses = np.column_stack([np.arange(n, dtype=float), np.zeros(n), np.zeros(n)])
    nothing = np.zeros((n, POINTS, 2))
    views = np.full((n, BINS), np.nan, np.float32)
    drive = np.zeros(n, np.int64)
    return Keyframes(poses, poses, poses[:, 0].copy(), drive, views, nothing, nothing, drive.copy())


def closed(frames: Keyframes) -> Overlaps:
    """Return what keyframes have in common of which the last one sees all that the first one has seen."""
    overlaps = overlaps_of(frames)
    holds = np.zeros((1, 6, 6))
    jacobian = np.hstack([np.eye(3), -np.eye(3)])
    jacobian[1, 5] = len(frames) - 1.0  # the last pose from the place of the first one
    holds[0] = 1e3 * jacobian.T @ jacobian
    counts = np.array([[10.0, 0.0, 0.0]])
    frames.counts[0] = 10
    return overlaps._replace(
        pairs=np.vstack([overlaps.pairs, [0, len(frames) - 1]]),
        following=np.append(overlaps.following, False),
        counts=np.vstack([overlaps.counts, counts]),
        information=np.concatenate([overlaps.information, holds]),
    )


def test_drift_grows_with_the_length_of_the_drive() -> None:
    std = [expected_std(frames, overlaps_of(frames)).max() for frames in map(line_of, (4, 8, 16, 32))]
    assert all(2 * short < long for short, long in pairwise(std))


def test_another_pass_holds_the_drive() -> None:
    frames = line_of(POSES)
    free = expected_std(frames, overlaps_of(frames))
    assert expected_std(frames, closed(frames)).max() < 0.6 * free.max()


def test_an_open_drive_is_uncertain_at_its_ends() -> None:
    frames = line_of(POSES)
    std = expected_std(frames, overlaps_of(frames))
    assert int(std.argmax()) in (0, POSES - 1) and (std >= 0.0).all()


def test_the_joint_of_two_drives_is_uncertain() -> None:
    frames = line_of(POSES)
    one = expected_std(frames, overlaps_of(frames))
    frames.drive[POSES // 2 :] = 1
    assert expected_std(frames, overlaps_of(frames)).max() > 2 * one.max()


@pytest.mark.parametrize("n", [2, 3])
def test_few_keyframes_suffice(n: int) -> None:
    assert np.isfinite(expected_std(line_of(n), overlaps_of(line_of(n)))).all()

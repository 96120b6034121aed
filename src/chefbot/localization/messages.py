"""Messages of a localization: pose, status and particles."""

from __future__ import annotations

import numpy as np

from chefbot.localization.amcl import Amcl
from chefbot.localization.particle_filter import CONVERGED_EXPLAINED, CONVERGED_SHARE
from chefbot.localization.pose_probability import PoseQuality
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.nav2_msgs import Particle, ParticleCloud
from chefbot.msgs.std_msgs import Header

NOTABLE_NEWS = 0.3
"""Share of a scan that the map does not explain from which it is named although the robot is localized."""
PROBABLE = 0.5
"""Probability below which a pose is perhaps wrong although the filter has converged."""
SHOWN_PARTICLES = 500
"""Maximum number of particles published; more would only slow down the web UI."""


def pose_message(amcl: Amcl, stamp_ns: int) -> PoseWithCovarianceStamped:
    """Return the estimated pose on the map with its covariance."""
    pose = PoseWithCovariance(Pose.of(amcl.pose), covariance_36(amcl.covariance))
    return PoseWithCovarianceStamped(Header.of(stamp_ns, "map"), pose)


def why_not_on_map(message: PoseWithCovarianceStamped, grid: Grid | None = None) -> str:
    """Return why an initial pose is no pose on the map, or an empty string; without a grid its frame is checked only.

    An empty frame is the map's.
    """
    frame, pose = message.header.frame_id, message.pose.pose.se2
    if frame not in ("", "map"):
        return f"its frame is {frame}, not map"
    if grid is None or grid.contains(pose.x, pose.y):
        return ""
    return f"{pose.x:.2f}, {pose.y:.2f} m lies outside the map"


def status_message(amcl: Amcl, stamp_ns: int) -> LocalizationStatus:
    """Return whether the filter has converged, how probable its pose is, and how far it may be off."""
    quality, header = amcl.quality, Header.of(stamp_ns, "map")
    sentence = describe(quality, amcl.converged)
    spreads = quality.spread, quality.spread_yaw
    return LocalizationStatus(
        header, amcl.converged, quality.probability, *spreads, len(amcl.particles), sentence
    )


def describe(quality: PoseQuality, localized: bool) -> str:
    """Return the state of the localization in a sentence: localized, unsure or lost, and why."""
    unexplained = 1.0 - quality.explained
    if localized and quality.probability < PROBABLE:
        return f"Localized, but perhaps wrong: {unexplained:.0%} of the scan is not on the map here."
    if localized:
        news = f"; {unexplained:.0%} of the scan is not on the map" if unexplained > NOTABLE_NEWS else ""
        return f"Localized to within {quality.spread:.2f} m{news}."
    if quality.updates == 0:
        return "Unsure: no scan has been compared with the map yet."
    if quality.weight < CONVERGED_SHARE:
        return f"Unsure: several places are possible, the likeliest with {quality.weight:.0%}."
    if quality.explained < CONVERGED_EXPLAINED:
        return f"Lost: {unexplained:.0%} of the scan is not on the map here."
    if quality.outperformed:
        return "Unsure: another place explains the scans better."
    return f"Unsure: the position is known to within {quality.spread:.2f} m only."


def particle_cloud(amcl: Amcl, now_ns: int) -> ParticleCloud:
    """Return a sample of the particles for display."""
    step = max(1, len(amcl.particles) // SHOWN_PARTICLES)
    particles = tuple(
        Particle(Pose.of(SE2.of(pose)), float(weight))
        for pose, weight in zip(amcl.particles[::step], amcl.weights[::step], strict=True)
    )
    return ParticleCloud(Header.of(now_ns, "map"), particles)


def same_grid(first: Grid, second: Grid) -> bool:
    """Return whether two maps have the same geometry and the same cells."""
    same_geometry = (first.origin_x, first.origin_y, first.resolution) == (
        second.origin_x,
        second.origin_y,
        second.resolution,
    )
    return same_geometry and np.array_equal(first.cells, second.cells)

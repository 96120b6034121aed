"""Parameters of the tracking of people."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class PeopleTrackerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of tracking people in scans, of the `PeopleTracker`."""

    max_range: Annotated[
        float, Meta(ge=0.5, le=30.0, description="distance up to which people are detected, m")
    ] = 6.0
    acceleration: Annotated[
        float,
        Meta(
            ge=0.1,
            le=10.0,
            description="square root of the spectral density of a person's acceleration, m/s^1.5",
        ),
    ] = 0.8
    memory: Annotated[
        float,
        Meta(
            ge=1.0,
            le=600.0,
            description="time for which the tracker remembers that a place was free, s",
        ),
    ] = 30.0
    max_unseen: Annotated[
        float,
        Meta(ge=0.1, le=60.0, description="time after which the track of an occluded person is deleted, s"),
    ] = 8.0
    max_people: Annotated[
        int, Meta(ge=1, le=200, description="maximum number of tracks, tentative ones included")
    ] = 60

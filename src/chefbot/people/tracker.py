"""Multi-target tracking of people with Kalman filters and global nearest neighbour association.

Birth and death by evidence as in Arras et al. 2008, "Efficient people tracking in laser range data using a
multi-hypothesis leg-tracker with adaptive occlusion probabilities", with one hypothesis.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.people.association import NO_TRACK, associate
from chefbot.people.background import Background
from chefbot.people.candidates import Candidates, Measurement, find_candidates, group_legs, measure
from chefbot.people.motion_model import MotionState, measurement_update
from chefbot.people.observation import Observation
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.segmentation import find_segments
from chefbot.people.track import (
    CONFIRMED_EVIDENCE,
    FREE_EVIDENCE,
    INITIAL_SPEED,
    MIN_MEASUREMENTS,
    TENTATIVE_ID,
    PersonTrack,
    Sighting,
)
from chefbot.people.visibility import seen_free

GATE = 9.21
"""Squared Mahalanobis distance that a measurement of two dimensions stays within with a probability of 0.99."""
MAX_JUMP = 0.7
"""Distance of a measurement from a prediction beyond which they never belong together, m."""
ASSOCIATION_DEVIATION = 0.13
"""Standard deviation of a leg from the middle of its person, m."""
SECOND_LEG_COST, STAYS_COST, STANDING_STAYS_COST = 1.5, 7.0, 2.0
"""Additional cost of a second candidate, and of one where returns have stayed, for people who move and for others."""
MIN_DISTANCE = 0.3
"""Distance within which two tracks are one person, m."""
MAX_LAG, RESET_COUNT = 0.5, 10
"""Age beyond which an observation is ignored, s, and the number of them in a row after which the clock has been set
back."""
MAX_CANDIDATES = 150
"""Candidates of an observation that are used, the nearest first."""
MAX_DEVIATION = 1.5
"""Standard deviation of the position beyond which a track ends, m."""


class PeopleTracker:
    """Tracks people through the observations of all sensors, in one frame in which poses do not jump.

    tracks: all, also tentative ones.
    """

    def __init__(self, params: PeopleTrackerParams) -> None:
        self.params = params
        self._warning = ""
        self._background = Background()
        self._next_id = TENTATIVE_ID + 1
        self._reset(-math.inf)

    def _reset(self, time: float) -> None:
        self.tracks: list[PersonTrack] = []
        self.time, self._late = time, 0

    @property
    def people(self) -> list[PersonTrack]:
        """Tracks that are people, in the order of their ids."""
        return sorted((track for track in self.tracks if track.confirmed), key=lambda track: track.id)

    def set_map(self, grid: Grid) -> None:
        """Set or replace the static map, whose obstacles are not people."""
        self._background.set_map(grid)

    def update(self, observation: Observation, time: float, map_T_frame: SE2 | None = None) -> bool:
        """Update all tracks with an observation at a time (s); return False if it was ignored.

        Observations of several sensors may be out of order by MAX_LAG. map_T_frame: pose of the tracking frame in the
        frame of the map, None if it is not known.
        """
        if not (math.isfinite(time) and observation.is_usable and self._accept_time(time)):
            return False
        lag = max(self.time - time, 0.0)
        self.time = max(self.time, time)
        for track in self.tracks:
            track.advance(self.time, self.params.acceleration**2)
        candidates = self._candidates(observation, map_T_frame)
        owner, tracks = self._associate(candidates, lag), list(self.tracks)
        self._correct(candidates, owner, observation.sensor, lag)
        self._note_unseen(observation, owner)
        self._begin(candidates, owner, observation.sensor)
        self._end_and_confirm()
        self._update_background(observation, candidates, owner, tracks)
        return True

    def _update_background(
        self,
        observation: Observation,
        candidates: Candidates,
        owner: NDArray[np.int64],
        tracks: list[PersonTrack],
    ) -> None:
        people = np.array([*(track.likely for track in tracks), False])  # the last one for NO_TRACK
        beams = candidates.beams(people[owner], len(observation.ranges))
        self._background.update(observation, beams, self.time, self.params.max_range)

    def take_warning(self) -> str:
        """Return what could not be used since the last call, one sentence, empty for nothing."""
        warning, self._warning = self._warning, ""
        return warning

    def _accept_time(self, time: float) -> bool:
        if time >= self.time - MAX_LAG:
            self._late = 0
            return True
        self._late += 1
        self._warning = (
            f"A sensor message is {self.time - time:.1f} s older than the newest one; it is ignored."
        )
        if self._late >= RESET_COUNT:
            self._reset(time)  # the clock was set back
            self._background.forget_times()
        return False

    def _candidates(self, observation: Observation, map_T_frame: SE2 | None) -> Candidates:
        params = self.params
        segments = find_segments(observation)
        found = find_candidates(
            observation, segments, self._background, map_T_frame, self.time - params.memory, params.max_range
        )
        if found.size <= MAX_CANDIDATES:
            return found
        self._warning = f"{found.size} segments may be legs; only the nearest {MAX_CANDIDATES} are used."
        return found.nearest(MAX_CANDIDATES)

    def _associate(self, candidates: Candidates, lag: float) -> NDArray[np.int64]:
        """Return the number of the track of each candidate, NO_TRACK for none; confirmed tracks first."""
        owner = np.full(candidates.size, NO_TRACK, np.int64)
        for confirmed in (True, False):
            rows = np.flatnonzero([track.confirmed == confirmed for track in self.tracks])
            free = np.flatnonzero((owner == NO_TRACK) & ~candidates.on_map)
            costs = self._costs([self.tracks[i] for i in rows], candidates, free, lag)
            found = associate(costs, GATE, slots=2, extra=SECOND_LEG_COST)
            chosen = found != NO_TRACK
            owner[free[chosen]] = rows[found[chosen]]
        return owner

    def _costs(
        self, tracks: list[PersonTrack], candidates: Candidates, free: NDArray[np.int64], lag: float
    ) -> NDArray[np.float64]:
        """Return the costs of pairing tracks with candidates (numbers), (tracks, candidates), inf beyond MAX_JUMP."""
        state = np.array([track.state for track in tracks]).reshape(-1, 7)
        at = state[:, None, :2] - lag * state[:, None, 2:4]
        square = ((candidates.position[None, free] - at) ** 2).sum(axis=2)
        costs = square / (state[:, 4:5] + ASSOCIATION_DEVIATION**2)
        moving = np.array([track.confirmed and not track.standing for track in tracks], np.bool_)
        stays_cost = np.where(moving, STAYS_COST, STANDING_STAYS_COST)
        costs = costs + np.where(candidates.stays[free], stays_cost[:, None], 0.0)
        return np.where(square <= MAX_JUMP**2, costs, np.inf)

    def _correct(self, candidates: Candidates, owner: NDArray[np.int64], sensor: SE2, lag: float) -> None:
        for i, track in enumerate(self.tracks):
            chosen = np.flatnonzero(owner == i)
            if len(chosen):
                seen = measure(candidates, chosen, sensor)
                variance = seen.deviation**2 + lag * lag * track.state.speed_variance
                moved = seen._replace(x=seen.x + lag * track.state.vx, y=seen.y + lag * track.state.vy)
                track.take(measurement_update(track.state, moved.x, moved.y, variance), moved)

    def _note_unseen(self, observation: Observation, owner: NDArray[np.int64]) -> None:
        """Lower the evidence of tracks whose place was seen free; an occluded one only grows in covariance."""
        seen = set(owner.tolist())
        for i, track in enumerate(self.tracks):
            if i not in seen:
                track.add_evidence(FREE_EVIDENCE * seen_free(observation, track.state))

    def _begin(self, candidates: Candidates, owner: NDArray[np.int64], sensor: SE2) -> None:
        """Begin a tentative track for each pair of legs or single segment without a track that may be a person."""
        free = np.flatnonzero((owner == NO_TRACK) & ~candidates.on_map)
        for group in group_legs(candidates, free):
            seen = measure(candidates, group, sensor)
            if self._may_be_person(candidates, group, seen):
                self._begin_track(seen)

    def _begin_track(self, seen: Measurement) -> None:
        limit = self.params.max_people
        if len(self.tracks) >= limit:
            self._warning = f"More than {limit} people or tentative tracks; the others are not tracked."
            return
        state = MotionState(seen.x, seen.y, 0.0, 0.0, seen.deviation**2, 0.0, INITIAL_SPEED**2)
        sighting = Sighting(seen.x, seen.y, self.time)
        self.tracks.append(PersonTrack(TENTATIVE_ID, state, self.time, sighting, sighting))

    def _may_be_person(self, candidates: Candidates, group: NDArray[np.int64], seen: Measurement) -> bool:
        if any(track.state.distance(seen.x, seen.y) < MIN_DISTANCE for track in self.tracks):
            return False
        if bool(candidates.segments.through_gap[group].all()):
            return False  # a piece of a wall behind a door moves as the robot does
        has_come = bool((candidates.apart & ~candidates.stays)[group].all())
        return seen.pair or seen.novel or seen.body or seen.leg or has_come

    def _end_and_confirm(self) -> None:
        kept: list[PersonTrack] = []
        # people first, the oldest first: of two tracks at one place the later one ends
        for track in sorted(self.tracks, key=lambda track: (not track.confirmed, track.id)):
            if not self._ends(track) and not any(_same_place(track, other) for other in kept):
                kept.append(track)
        self.tracks = kept
        for track in kept:
            if (
                not track.confirmed
                and track.evidence >= CONFIRMED_EVIDENCE
                and track.measurements >= MIN_MEASUREMENTS
            ):
                track.id = self._next_id
                self._next_id += 1

    def _ends(self, track: PersonTrack) -> bool:
        unseen = self.time - track.last_seen.time
        limit = self.params.max_unseen if track.confirmed else 1.0
        return track.over or unseen > limit or track.state.deviation > MAX_DEVIATION


def _same_place(one: PersonTrack, other: PersonTrack) -> bool:
    """Return whether two tracks are so near that they are one person."""
    return one.state.distance(other.state.x, other.state.y) < MIN_DISTANCE

"""Tracked people as messages, and their prediction from a message."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseArray, Vector3
from chefbot.msgs.people_msgs import People, Person
from chefbot.msgs.std_msgs import Header
from chefbot.people.motion_model import MotionState, propagate
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.track import PersonTrack

TRACKED_PEOPLE_TIMEOUT_NS = 1_000_000_000
"""Age from which the places of people in a message count no more, ns."""


def is_outdated(people: TrackedPeople, now_ns: int) -> bool:
    """Return whether a message is too old to state where people are."""
    return now_ns - people.header.stamp.ns > TRACKED_PEOPLE_TIMEOUT_NS


def tracked_people(header: Header, tracks: Sequence[PersonTrack]) -> TrackedPeople:
    """Return the people of all tracks with covariances and last sightings."""
    return TrackedPeople(header, tuple(_tracked_person(track) for track in tracks))


def _tracked_person(track: PersonTrack) -> TrackedPerson:
    state, seen = track.state, track.last_seen
    return TrackedPerson(
        track.id,
        Point(state.x, state.y),
        Vector3(state.vx, state.vy),
        state.covariance().reshape(16),
        track.confidence,
        track.standing,
        track.visible,
        Time.of(round(seen.time * 1e9)),
        Point(seen.x, seen.y),
    )


def people_message(tracked: TrackedPeople) -> People:
    """Return people as leg detectors of ROS publish them; their names are their numbers."""
    return People(
        tracked.header,
        tuple(
            Person(str(one.id), one.position, Point(one.velocity.x, one.velocity.y), one.confidence)
            for one in tracked.people
        ),
    )


def people_poses(tracked: TrackedPeople) -> PoseArray:
    """Return the poses of people, x along their velocity."""
    poses = (
        Pose.of(SE2(one.position.x, one.position.y, math.atan2(one.velocity.y, one.velocity.x)))
        for one in tracked.people
    )
    return PoseArray(tracked.header, tuple(poses))


def predict_person(person: TrackedPerson, seconds: float, acceleration: float) -> MotionState:
    """Return where a person will be in some seconds: constant velocity, none if standing, with growing covariance.

    acceleration: as in `PeopleTrackerParams`, m/s^1.5.
    """
    vx, vy = (0.0, 0.0) if person.standing else (person.velocity.x, person.velocity.y)
    covariance = person.covariance.reshape(4, 4)
    state = MotionState(
        person.position.x,
        person.position.y,
        vx,
        vy,
        float(covariance[0, 0]),
        float(covariance[0, 2]),
        float(covariance[2, 2]),
    )
    return propagate(state, seconds, acceleration**2)


def predicted_states(tracked: TrackedPeople, seconds: float, frame: SE2) -> NDArray[np.float64]:
    """Return the states (n, 7) of all people in some seconds, with the columns of `MotionState`.

    frame: pose of the message's frame in the frame of the result.
    """
    acceleration = PeopleTrackerParams().acceleration
    states = np.array([predict_person(one, seconds, acceleration) for one in tracked.people]).reshape(-1, 7)
    states[:, :2] = frame.apply(states[:, :2])
    states[:, 2:4] = SE2(0.0, 0.0, frame.yaw).apply(states[:, 2:4])
    return states

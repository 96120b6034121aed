"""Sentences that describe causes and their chains."""

from __future__ import annotations

import re

from chefbot.causes.reports import CONTACT, DETOUR, END, FAILURE, MAP, RANGER, SLOW, STOP, TRACKER, is_zone
from chefbot.msgs.chefbot_msgs import Cause

PERSON, ON_MAP, NOT_ON_MAP = "person", "on the map", "not on the map"
"""What an obstacle is, by the tracked people and the static map."""
MAX_FRESH_AGE = 0.15
"""Age of a mark up to which it counts as of now, s: a measurement and its way through the robot."""
_PLAIN_WORD = re.compile(r"[A-Z][a-z]*(?!\w)")
EFFECT_NAMES = {SLOW: "Slower", STOP: "Stopped", DETOUR: "Detour", FAILURE: "Failed", END: "Over"}
"""Names of the effects of causes, for lists and pictures."""


def obstacle_phrase(cause: Cause) -> str:
    """Return what the obstacle is: "person 3", "an obstacle that is not on the map"."""
    if cause.obstacle == PERSON:
        return f"person {cause.person}"
    if cause.obstacle == ON_MAP:
        return "an obstacle that is on the map"
    return "an obstacle that is not on the map" if cause.obstacle == NOT_ON_MAP else "an obstacle"


def age_of_mark(cause: Cause) -> float:
    """Return how long before the cause its obstacle was last marked, s; 0 if that is not known."""
    if not cause.marked_at.ns:
        return 0.0
    return max(0.0, (cause.header.stamp.ns - cause.marked_at.ns) / 1e9)


def place_sentence(cause: Cause) -> str:
    """Return who marked what, where and when, as a sentence; empty without a place."""
    if not cause.located:
        return ""
    where = f"at {_position(cause)}"
    if cause.sensor == MAP:
        return f"The map has an obstacle {where}."
    if is_zone(cause.sensor):
        return f"The {cause.sensor} lies {where}."
    age = age_of_mark(cause)
    when = f", {age:.1f} s earlier" if age > MAX_FRESH_AGE else ""
    what = obstacle_phrase(cause)
    if cause.sensor == TRACKER:
        return f"{what[0].upper()}{what[1:]} is {where}{when}."
    if cause.sensor == RANGER:
        return f"The {cause.sensor} marked {what} in its cone {where}{when}."
    if cause.sensor == CONTACT:
        return f"The robot touched {what} {where}{when}."
    return f"The {cause.sensor} marked {what} {where}{when}."


def _position(cause: Cause) -> str:
    """Return the position of a cause, with its frame if that is not the map's."""
    frame = cause.header.frame_id
    position = f"x {cause.point.x:.2f} m, y {cause.point.y:.2f} m"
    return position if frame == "map" else f"{position} in {frame}"


def place_links(cause: Cause) -> tuple[str, ...]:
    """Return the last links of a chain: the cell with its sensor and the time of the mark, and the obstacle."""
    if not cause.located:
        return ()
    at = f" at {cause.marked_at.ns / 1e9:.2f} s" if cause.marked_at.ns else ""
    if is_zone(cause.sensor):
        return (f"{cause.sensor}: {_position(cause)}",)
    cell = f"{cause.sensor}: {_position(cause)}, marked{at}"
    if not cause.obstacle:
        return (cell,)
    person = f" {cause.person}" if cause.obstacle == PERSON else ""
    return cell, f"obstacle: {cause.obstacle}{person}"


def effect_word(cause: Cause) -> str:
    """Return the effect of a cause in one word, for lists and pictures."""
    return EFFECT_NAMES.get(cause.kind, cause.kind)


def after_colon(sentence: str) -> str:
    """Return a sentence as it continues another after a colon: in lower case unless it begins with a name.

    A first word with further capitals or digits, such as STOP, SLAM or Nav2, is taken for a name.
    """
    return f"{sentence[0].lower()}{sentence[1:]}" if _PLAIN_WORD.match(sentence) else sentence


def joined(own: str, behind: str) -> str:
    """Return the sentence of a check followed by that of its cause, without repeating what is in both."""
    head, _, detail = own.partition(": ")
    known = detail.rstrip(".").lower()
    if known and behind.lower().startswith(known):
        return f"{head}: {after_colon(behind)}"
    return f"{own if own.endswith('.') else own + '.'} {behind}"

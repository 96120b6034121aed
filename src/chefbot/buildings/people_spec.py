"""How many people walk in a world, and what share of them behaves in which way."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

MAX_PEOPLE = 50
Count = Annotated[int, Meta(ge=0, le=MAX_PEOPLE)]


class PeopleSpec(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """People of a simulated world. The shares of the kinds add up to at most 1; the rest walk between destinations.

    Raises ValueError for shares that add up to more, and for a slowest speed above the fastest.
    """

    count: Annotated[int, Meta(ge=0, le=MAX_PEOPLE, description="number of people")] = 0
    avoid_robot: Annotated[
        bool,
        Meta(description="whether people avoid the robot; false: they only stop where they would touch it"),
    ] = True
    stand_and_talk: Annotated[
        float, Meta(ge=0, le=1, description="share that stands and talks in doorways, in pairs")
    ] = 0.0
    groups: Annotated[float, Meta(ge=0, le=1, description="share that walks in groups")] = 0.0
    group_size: Annotated[int, Meta(ge=2, le=5, description="number of people in a group")] = 2
    step_out: Annotated[
        float, Meta(ge=0, le=1, description="share that steps out from behind a corner in front of the robot")
    ] = 0.0
    pull_chairs: Annotated[
        float, Meta(ge=0, le=1, description="share that pulls chairs out and pushes them in")
    ] = 0.0
    doors: Annotated[float, Meta(ge=0, le=1, description="share that opens and closes doors")] = 0.0
    follow: Annotated[float, Meta(ge=0, le=1, description="share that follows the robot")] = 0.0
    block: Annotated[float, Meta(ge=0, le=1, description="share that blocks the robot for fun")] = 0.0
    slowest: Annotated[float, Meta(ge=0.2, le=2.5, description="lowest walking speed, m/s")] = 0.6
    fastest: Annotated[float, Meta(ge=0.2, le=2.5, description="highest walking speed, m/s")] = 1.2
    reaction_time: Annotated[
        float,
        Meta(ge=0, le=3, description="delay until people see where the robot is, s"),
    ] = 0.5
    reaction_distance: Annotated[
        float,
        Meta(gt=0, le=20, description="distance within which people see the robot, m"),
    ] = 4.0

    def __post_init__(self) -> None:
        """Check what concerns several fields."""
        total = sum(getattr(self, name) for name in KINDS)
        if total > 1.0 + 1e-9:
            raise ValueError(f"the shares of the kinds of people add up to {total:g}, more than 1")
        if self.slowest > self.fastest:
            raise ValueError(
                f"the slowest speed, {self.slowest:g} m/s, is above the fastest, {self.fastest:g}"
            )


KINDS = ("stand_and_talk", "groups", "step_out", "pull_chairs", "doors", "follow", "block")
"""Fields of `PeopleSpec` that are shares of kinds."""


def people_spec(people: int | PeopleSpec) -> PeopleSpec:
    """Return the spec of a plain number of people, who walk between destinations and avoid the robot."""
    return PeopleSpec(count=people) if isinstance(people, int) else people


def people_of_each_kind(spec: PeopleSpec) -> dict[str, int]:
    """Return the number of people of each kind: shares of the count, rounded by largest remainders."""
    exact = {kind: getattr(spec, kind) * spec.count for kind in KINDS}
    numbers = {kind: int(value + 1e-9) for kind, value in exact.items()}
    remaining = round(sum(exact.values())) - sum(numbers.values())
    # The sort is stable: equal remainders keep the order of the fields.
    for kind in sorted(KINDS, key=lambda name: numbers[name] - exact[name])[:remaining]:
        numbers[kind] += 1
    return numbers


NOBODY = PeopleSpec()

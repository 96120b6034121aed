"""Who is of which kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from numpy.random import Generator

from chefbot.buildings.people_spec import PeopleSpec, people_of_each_kind
from chefbot.sim.people.kinds import Blocker, Companion, Follower, PullsChairs, StepsOut, Talker, UsesDoors
from chefbot.sim.people.person import SimulatedPerson

if TYPE_CHECKING:
    from chefbot.sim.people.people import SimulatedPeople

WALKER = "walker"
KIND_OF: dict[str, type[SimulatedPerson]] = {
    "stand_and_talk": Talker,
    "groups": SimulatedPerson,
    "step_out": StepsOut,
    "pull_chairs": PullsChairs,
    "doors": UsesDoors,
    "follow": Follower,
    "block": Blocker,
    WALKER: SimulatedPerson,
}


def kinds_of(spec: PeopleSpec) -> list[str]:
    """Return the kind of each person, in the order of the spec's fields, those who only walk at the end."""
    kinds = [kind for kind, number in people_of_each_kind(spec).items() for _ in range(number)]
    return kinds + [WALKER] * (spec.count - len(kinds))


def leaders_of(spec: PeopleSpec) -> list[int | None]:
    """Return for each person the first member of its group, None for the first ones and for all outside groups."""
    members = [i for i, kind in enumerate(kinds_of(spec)) if kind == "groups"]
    leaders: list[int | None] = [None] * spec.count
    for k, i in enumerate(members):
        first = k - k % spec.group_size
        leaders[i] = members[first] if k > first else None
    return leaders


def cast(scene: SimulatedPeople, rngs: Sequence[Generator]) -> list[SimulatedPerson]:
    """Return all people of a scene, with their groups and pairs."""
    spec, persons, leaders = scene.spec, list[SimulatedPerson](), leaders_of(scene.spec)
    for i, (kind, rng) in enumerate(zip(kinds_of(spec), rngs, strict=True)):
        leader = leaders[i]
        pace = float(rng.uniform(spec.slowest, spec.fastest))
        if leader is None:
            persons.append(KIND_OF[kind](scene, i, rng, pace))
        else:
            persons.append(Companion(scene, i, rng, pace, persons[leader]))
        if kind == "groups":
            scene.walkers.group[i] = i if leader is None else leader
    talkers = [person for person in persons if isinstance(person, Talker)]
    for one, other in zip(talkers[::2], talkers[1::2], strict=False):
        one.partner, other.partner = other, one
    return persons

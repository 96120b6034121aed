"""What a change of the map was, in a sentence for the person who may undo it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from chefbot.devices.maps.map_content import MapChange
from chefbot.msgs.chefbot_msgs.maps import MapEdit, MapZone
from chefbot.place_names import display_name
from chefbot.storage.places import PlaceEntry

MAX_NAMED = 3
"""Number of changed places and zones up to which each is named."""


def edit_description(edit: MapEdit, change: MapChange) -> str:
    """Return a sentence without its full stop, as "Table 1 was moved"; places have their labels."""
    if edit.rotation:
        return f"The map was rotated by {math.degrees(edit.rotation):.0f}°"
    if edit.crop:
        return "The map was cropped"
    if edit.strokes:
        return "The map was drawn on"
    before, after = change
    zones = [{zone.name: zone for zone in content.zones} for content in change]
    sentences = [*_place_changes(before.places, after.places), *_zone_changes(*zones)]
    if len(sentences) > MAX_NAMED:
        return f"{len(sentences)} places and zones were changed"
    return "; ".join(sentences)


def _place_changes(before: Mapping[str, PlaceEntry], after: Mapping[str, PlaceEntry]) -> Iterator[str]:
    titles = {name: display_name(name, entry.label) for name, entry in {**after, **before}.items()}
    for name, title in titles.items():
        old, new = before.get(name), after.get(name)
        if old is None or new is None:
            yield f"{title} was {'added' if old is None else 'removed'}"
        elif (old.x, old.y, old.yaw) != (new.x, new.y, new.yaw):
            yield f"{title} was moved"
        elif old.label != new.label:
            yield f"{title} was renamed {display_name(name, new.label)}"


def _zone_changes(before: Mapping[str, MapZone], after: Mapping[str, MapZone]) -> Iterator[str]:
    for name, zone in {**after, **before}.items():
        if name not in before or name not in after:
            yield f"{zone.title} was {'added' if name in after else 'removed'}"
        elif before[name] is not after[name]:
            yield f"{zone.title} was changed"

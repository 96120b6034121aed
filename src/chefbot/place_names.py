"""Names of places as people read them: the label of a place, else its name with spaces."""

from __future__ import annotations

import re
from collections.abc import Mapping


def display_name(place: str, label: str = "") -> str:
    """Return the label of a place, if it has one, else its name with spaces for underscores."""
    return label or place.replace("_", " ")


def with_labels(text: str, labels: Mapping[str, str]) -> str:
    """Return a sentence with labels instead of the names, or display names, of the places that have one.

    labels: label by name.
    """
    if not labels:
        return text
    longest_first = sorted(labels, key=len, reverse=True)
    names = "|".join(re.escape(name).replace("_", "[_ ]") for name in longest_first)
    return re.sub(rf"\b(?:{names})\b", lambda found: labels[found[0].replace(" ", "_")], text)

"""Words that robotics has better ones for (docs/glossary.md): they must not stand in names, docstrings or texts."""

from __future__ import annotations

from typing import NamedTuple


class Words(NamedTuple):
    """Parts of identifiers, and words or phrases of prose."""

    identifiers: tuple[str, ...]
    prose: tuple[str, ...]


# fmt: off
WORDS = Words(
    identifiers=(
        "told", "tell", "tells", "heard", "hear", "hears", "said", "say", "says", "asked", "ask",
        "asks", "wish", "words", "sane", "least", "most", "anew", "sums", "whom", "speaks",
        "speak", "spoken", "hump",
    ),
    prose=(
        "anew", "sums", "hear", "hears", "heard", "tell", "tells", "told", "says", "said", "speaks",
        "speak", "spoken", "wish", "wishes", "sane", "hump", "guesses", "rim", "last words",
        "life before", "next life", "second life", "who comes late", "those who come late",
        "as fast as may be", "of all chance", "forth and back", "the board's line", "to the byte",
        "next seconds", "for ever", "gravest", "are nobody",
    ),
)
# fmt: on

"""The exception for errors that the user can correct, and name suggestions for its messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """Invalid input, described in one sentence: what is wrong, where, and what to do.

    The command line prints it without a traceback and exits with code 2.
    """


MAX_LISTED_NAMES = 12
"""Maximum number of names that are listed in full; of a longer list only the closest are shown."""
SUGGESTED_NAMES = 5
"""Number of closest names shown of a longer list."""


def name_hint(name: str, names: Iterable[str]) -> str:
    """Return a hint for an unknown name: `" (did you mean 'x'?)"`, or else the list of known names.

    The suggestion is a known name that begins with `name`, or the closest one.
    """
    names = sorted(names)
    completions = [candidate for candidate in names if len(name) > 1 and candidate.startswith(name)]
    suggestions = completions or difflib.get_close_matches(name, names, n=1)
    if suggestions:
        return f" (did you mean {suggestions[0]!r}?)"
    if len(names) > MAX_LISTED_NAMES:
        closest = difflib.get_close_matches(name, names, n=SUGGESTED_NAMES, cutoff=0.0)
        return f" (of {len(names)}, the nearest: {', '.join(closest)})"
    return f" (known: {', '.join(names)})" if names else ""

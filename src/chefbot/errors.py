"""The one exception that a user is meant to read."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """Bad input, said in one sentence: what is wrong, where, and what to do.

    The command line prints it without a traceback and exits with code 2.
    """


MOST_NAMES = 12
"""A list that a person still reads; of more, the nearest few are shown."""
NEAREST_NAMES = 5


def nearest(name: str, known: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"` for the known name that begins with `name` or is closest, else a list of all."""
    names = sorted(known)
    begun = [one for one in names if len(name) > 1 and one.startswith(name)]
    close = begun or difflib.get_close_matches(name, names, n=1)
    if close:
        return f" (did you mean {close[0]!r}?)"
    if len(names) > MOST_NAMES:
        few = difflib.get_close_matches(name, names, n=NEAREST_NAMES, cutoff=0.0)
        return f" (of {len(names)}, the nearest: {', '.join(few)})"
    return f" (known: {', '.join(names)})" if names else ""

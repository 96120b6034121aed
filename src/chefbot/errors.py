"""The root of all exceptions of chefbot, those that several packages share, and name suggestions."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ChefbotError(Exception):
    """The root of the exceptions for invalid input and for what the environment does not permit.

    The message is one sentence: what is wrong, where, and what to do. The command line prints it without a
    traceback and exits with code 2. Each package has its own subclasses, one for each case that a caller may
    want to handle.
    """


class UserError(ChefbotError):
    """A command, an option or an environment in which the program that the user started cannot work."""


class OdometryError(ChefbotError):
    """Odometry readings, or parameters of them, that no robot can have produced."""


class ScanError(ChefbotError):
    """A laser scan, depth image or camera model that contradicts itself or the parameters."""


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

"""Hints at arguments of a launch, in commands that have options instead."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from chefbot.errors import ChefbotError, UserError

_ARGUMENT = re.compile(r"\b(start|unknown):=")


def with_options(text: str) -> str:
    """Return a hint with options in place of the arguments of a launch: --start for start:=."""
    return _ARGUMENT.sub(r"--\1 ", text)


@contextmanager
def hints_at_options() -> Iterator[None]:
    """Raise errors within as UserError whose hints name options."""
    try:
        yield
    except ChefbotError as error:
        raise UserError(with_options(str(error))) from None

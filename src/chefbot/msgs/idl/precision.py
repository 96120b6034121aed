"""Numbers of the precision that their fields have on the wire, so that nobody sees more than it carries."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec.structs import force_setattr

from chefbot.msgs.idl.codegen import Source
from chefbot.msgs.idl.fields import NUMPY_TYPES, fields_of

if TYPE_CHECKING:
    from chefbot.msgs.idl.message import Message


exact: list[float | None] = [None]
"""The first single float of the message that is just being read: what was read has the wire's precision already."""


def single_floats(kind: type[Message]) -> list[str]:
    """Names of a type's fields of that precision."""
    return [one.name for one in fields_of(kind) if one.element == "float32" and not one.is_array]


def rounding(kind: type[Message]) -> Callable[[Any], None] | None:
    """A function that rounds a new message's single floats, and makes its sequences of numbers arrays of their type.

    None for a type that has neither.
    """
    numbers = [field for field in fields_of(kind) if field.element in NUMPY_TYPES]
    floats = single_floats(kind)
    arrays = [field for field in numbers if field.is_array]
    if not floats and not arrays:
        return None
    source = Source(
        "def f(m):", put=force_setattr, array=array, asarray=np.asarray, ndarray=np.ndarray, exact=exact
    )
    if floats:
        values = ", ".join(f"m.{name}" for name in floats)
        source.add(f"if m.{floats[0]} is exact[0]: return")
        source.add(f"v = array('f', ({values},)).tolist()")
        source.add(*(f"put(m, '{name}', v[{place}])" for place, name in enumerate(floats)))
    for field in arrays:
        dtype = source.name(np.dtype(NUMPY_TYPES[field.element]))
        source.add(f"v = m.{field.name}")
        source.add(f"if type(v) is not ndarray or v.dtype is not {dtype}:")
        source.add(f"    put(m, '{field.name}', asarray(v, {dtype}))")
    return source.compile()

"""Rounding of fields to their serialized precision, so that local and remote subscribers see equal values."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec.structs import force_setattr

from chefbot.msgs.idl.codegen import FunctionSource
from chefbot.msgs.idl.fields import NUMPY_TYPES, fields_of

if TYPE_CHECKING:
    from chefbot.msgs.idl.message import Message


exact: list[float | None] = [None]
"""The first float32 value of the message being deserialized, which needs no rounding any more."""


def float32_fields(kind: type[Message]) -> list[str]:
    """Return the names of a type's float32 fields that are not arrays."""
    return [field.name for field in fields_of(kind) if field.element == "float32" and not field.is_array]


def rounding(kind: type[Message]) -> Callable[[Any], None] | None:
    """Return a function that rounds a message's float32 fields and converts its sequences to numpy arrays.

    None for a type that has neither.
    """
    floats = float32_fields(kind)
    arrays = [field for field in fields_of(kind) if field.element in NUMPY_TYPES and field.is_array]
    if not floats and not arrays:
        return None
    source = FunctionSource(
        "def f(m):", put=force_setattr, array=array, asarray=np.asarray, ndarray=np.ndarray, exact=exact
    )
    if floats:
        _round_floats(source, floats)
    for field in arrays:
        dtype = source.name(np.dtype(NUMPY_TYPES[field.element]))
        source.add(f"v = m.{field.name}")
        source.add(f"if type(v) is not ndarray or v.dtype is not {dtype}:")
        source.add(f"    put(m, '{field.name}', asarray(v, {dtype}))")
    return source.compile()


def _round_floats(source: FunctionSource, floats: list[str]) -> None:
    values = ", ".join(f"m.{name}" for name in floats)
    source.add(f"if m.{floats[0]} is exact[0]: return")
    source.add(f"v = array('f', ({values},)).tolist()")
    source.add(*(f"put(m, '{name}', v[{index}])" for index, name in enumerate(floats)))

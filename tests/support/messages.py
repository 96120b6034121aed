"""All message types, and Hypothesis strategies for their instances."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

import numpy as np
from hypothesis import strategies as st

import chefbot.msgs
from chefbot.msgs.idl.fields import NUMPY_TYPES, MessageField, fields_of
from chefbot.msgs.idl.message import Message


def all_modules() -> list[ModuleType]:
    """Import all modules of message types; `idl.editions` has older ones, with the names of the newest."""
    found = pkgutil.walk_packages(chefbot.msgs.__path__, "chefbot.msgs.")
    names = [module.name for module in found if not module.name.startswith("chefbot.msgs.idl")]
    return [importlib.import_module(name) for name in names]


def all_messages() -> list[type[Message]]:
    found: list[type[Message]] = []
    for loaded in all_modules():
        classes = [value for value in vars(loaded).values() if isinstance(value, type)]
        found += [
            kind for kind in classes if issubclass(kind, Message) and kind.__module__ == loaded.__name__
        ]
    return [kind for kind in found if kind is not Message]


INTEGERS = {"int8": 8, "int16": 16, "int32": 32, "int64": 64}


def values_of(field: MessageField) -> st.SearchStrategy:
    if field.message is not None:
        one = instances_of(field.message)
        shortest, longest = field.fixed_size, field.fixed_size or field.bound or 3
        return st.lists(one, min_size=shortest, max_size=longest).map(tuple) if field.is_array else one
    if field.element == "string":
        text = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=9)
        return st.lists(text, max_size=3).map(tuple) if field.is_array else text
    if field.is_array:
        size = st.just(field.fixed_size) if field.fixed_size else st.integers(0, 9)
        dtype = NUMPY_TYPES[field.element]
        return size.map(lambda n: np.arange(1, n + 1).astype(dtype))
    return numbers_of(field.element)


def numbers_of(element: str) -> st.SearchStrategy:
    if element == "bool":
        return st.booleans()
    if element == "byte":
        return st.integers(0, 127)  # the maximum of the library that the tests compare with
    if element.startswith("float"):
        return st.floats(width=int(element[5:]), allow_nan=False)
    if element in INTEGERS:
        bits = INTEGERS[element]
        return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return st.integers(0, 2 ** int(element.removeprefix("uint")) - 1)


def instances_of(kind: type[Message]) -> st.SearchStrategy:
    return st.builds(kind, *(values_of(field) for field in fields_of(kind)))

"""Strict parsing of YAML files into typed structs; an error is one sentence with file and key."""

from __future__ import annotations

import errno
import math
import operator
import os
import re
import stat
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, TypeVar, cast

import msgspec
import yaml
from msgspec import inspect as types

from chefbot.errors import ChefbotError, name_hint
from chefbot.maths.units import UnitError, to_si
from chefbot.strict_yaml import load_strict
from chefbot.validation_text import validation_error_text

T = TypeVar("T")
MAX_BYTES = 1_000_000
BLOCK_BYTES = 1_000_000
"""Bytes that are read at once: memory is needed for what a file has, not for what it may have."""
BOUNDS = (
    ("gt", operator.gt, "above"),
    ("ge", operator.ge, "at least"),
    ("lt", operator.lt, "below"),
    ("le", operator.le, "at most"),
)
"""Bounds: attribute in msgspec, comparison that must hold, and text for error messages."""

_IMPOSSIBLE = (RecursionError, ValueError, OverflowError, AttributeError, KeyError, IndexError, TypeError)
"""Exceptions of PyYAML for deep nesting, impossible numbers, and values that do not fit their tag: `!!bool x`."""
CONTAINERS = (types.UnionType, types.StructType, types.ListType, types.VarTupleType, types.DictType)
"""Types with parts that are converted; a description of theirs changes nothing."""
READ_AS = {bool: "true or false", int: "a whole number", float: "a number", date: "a date"}
"""Types as which YAML reads a text without quotes; a boolean is an integer, too, so it comes first."""


class ConfigError(ChefbotError):
    """A file that cannot be read, or content of it with an unknown key, a wrong type or a value out of bounds."""


def find_file(kind: str, name_or_path: str, built_in: dict[str, Path], error: type[ChefbotError]) -> Path:
    """Return the path of a built-in file by its name, or of another file. Raises `error` for an unknown name."""
    if name_or_path in built_in:
        return built_in[name_or_path]
    if name_or_path.endswith((".yaml", ".yml")) or "/" in name_or_path:
        return Path(name_or_path)
    hint = name_hint(name_or_path, built_in)
    raise error(f"no {kind} is called {name_or_path!r}{hint}; give a name, or a file that ends in .yaml")


def read_bytes(path: Path, kind: str, limit: int = MAX_BYTES) -> bytes:
    """Read a file; ConfigError if it is missing, unreadable, no file, or longer than `limit` bytes.

    A named pipe or a device is refused: reading it could wait forever, or never end.
    """
    try:
        data = _read_file(path, limit)
    except FileNotFoundError:
        raise ConfigError(f"{kind} {path} does not exist; check the name") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{kind} {path} cannot be read: {reason}") from None
    if len(data) > limit:
        raise ConfigError(f"{kind} {path} is longer than {limit} bytes; that is not a {kind}")
    return data


def _read_file(path: Path, limit: int) -> bytes:
    """Return the content of a file, but of more than `limit` bytes only the first, and one too many."""
    with open_file(path) as file:
        blocks, missing = [], limit + 1
        while missing > 0 and (block := file.read(min(missing, BLOCK_BYTES))):
            blocks.append(block)
            missing -= len(block)
    return b"".join(blocks)


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading. Raises OSError, also for a folder, a named pipe or a device.

    A pipe without a writer would be waited for, and a device may never end.
    """
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    mode = os.fstat(handle).st_mode
    if not stat.S_ISREG(mode):
        os.close(handle)
        reason = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else "it is a pipe or a device, not a file"
        raise OSError(errno.EISDIR if stat.S_ISDIR(mode) else errno.EINVAL, reason)
    return os.fdopen(handle, "rb")


def parse_yaml(data: bytes, where: str) -> Any:
    """Parse YAML text into dicts, lists, numbers and strings."""
    try:
        return load_strict(data.decode())
    except UnicodeDecodeError:
        raise ConfigError(
            f"{where} is not text in UTF-8; it may be damaged or another kind of file"
        ) from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "it cannot be parsed"
        raise ConfigError(f"{where}{line}: not valid YAML: {problem}") from None
    except _IMPOSSIBLE:
        raise ConfigError(
            f"{where}: not valid YAML: nested too deeply or with an impossible number"
        ) from None


def build(value: Any, kind: type[T], where: str) -> T:
    """Convert plain data to the struct type `kind`, checking units, bounds and unknown keys."""
    plain = _to_si(value, _type_info(cast(Any, kind)), where, "")
    try:
        return msgspec.convert(plain, kind, strict=True)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{where}: {validation_error_text(error)}") from None


@cache
def _type_info(kind: type) -> types.Type:
    """Return msgspec's description of a type, which takes longer to make than most files to read."""
    return types.type_info(kind)


def _to_si(value: Any, kind: types.Type, where: str, key: str) -> Any:
    """Return `value` with all quantities in SI units; check here what msgspec reports unclearly."""
    if isinstance(kind, types.Metadata) and isinstance(kind.type, types.UnionType | types.DictType):
        kind = kind.type
    if isinstance(kind, types.Metadata) and isinstance(kind.type, CONTAINERS):
        kind = kind.type
    if isinstance(kind, types.UnionType):
        if value is None and kind.includes_none:
            return None
        members = [member for member in kind.types if not isinstance(member, types.NoneType)]
        if len(members) > 1 and all(isinstance(member, types.StructType) for member in members):
            return _tagged_to_si(value, cast(list[types.StructType], members), where, key)
        member = _member_for(value, kind)
        return value if member is None else _to_si(value, member, where, key)
    if isinstance(kind, types.StructType):
        return _struct_to_si(value, kind, where, key)
    if isinstance(kind, (types.ListType, types.VarTupleType)) and isinstance(value, list):
        return [_to_si(item, kind.item_type, where, f"{key}[{i}]") for i, item in enumerate(value)]
    if isinstance(kind, types.DictType) and isinstance(value, dict):
        return {k: _to_si(v, kind.value_type, where, _join(key, k)) for k, v in value.items()}
    unit = kind.extra.get("unit") if isinstance(kind, types.Metadata) and kind.extra else None
    written = value
    if unit is not None:
        value = _quantity(value, unit, where, key)
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{where}: {key}: {value} is not a finite number")
    _check_bounds(value, written, kind, unit or "", f"{where}: {key}")
    _check_text(value, kind, f"{where}: {key}")
    _check_form(value, kind, f"{where}: {key}")
    _check_choice(value, kind, f"{where}: {key}")
    return value


def _member_for(value: Any, kind: types.UnionType) -> types.Type | None:
    """Return the type of a union that a value is meant to have: its struct for a section, else what is left alone."""
    structs = [member for member in kind.types if isinstance(member, types.StructType)]
    others = [member for member in kind.types if not isinstance(member, (types.NoneType, types.StructType))]
    members = structs if structs and (isinstance(value, dict) or not others) else others
    return members[0] if len(members) == 1 else None


def _check_text(value: Any, kind: types.Type, where: str) -> None:
    """Check that a text was not read as another type, as `yes` and 1:30 are without quotes."""
    inner = kind.type if isinstance(kind, types.Metadata) else kind
    if isinstance(inner, types.StrType):
        for type_read, name in READ_AS.items():
            if isinstance(value, type_read):
                raise ConfigError(f"{where}: must be a text, not {name}; write it in quotes")


def _check_form(value: Any, kind: types.Type, where: str) -> None:
    """Check a string's pattern; the error describes it with the type's own `form` text."""
    if isinstance(kind, types.Metadata) and isinstance(kind.type, types.StrType) and isinstance(value, str):
        form, pattern = (kind.extra or {}).get("form"), kind.type.pattern
        if form and pattern and not re.search(pattern, value):
            raise ConfigError(f"{where}: {value[:40]!r} must be {form}")


def _check_choice(value: Any, kind: types.Type, where: str) -> None:
    """Check that a string is one of the given choices."""
    inner = kind.type if isinstance(kind, types.Metadata) else kind
    if isinstance(inner, types.LiteralType) and isinstance(value, str) and value not in inner.values:
        raise ConfigError(f"{where}: unknown value {value!r:.60}{name_hint(value, map(str, inner.values))}")


def _check_bounds(value: Any, written: Any, kind: types.Type, unit: str, where: str) -> None:
    """Check the bounds of a number.

    The error quotes the value as `written`, with its unit, unlike msgspec's.
    """
    inner = kind.type if isinstance(kind, types.Metadata) else kind
    if not isinstance(inner, (types.FloatType, types.IntType)) or not _is_number(value):
        return
    for name, holds, description in BOUNDS:
        bound = getattr(inner, name)
        if bound is not None and not holds(value, bound):
            raise ConfigError(f"{where}: {written!s:.60} must be {description} {bound:g} {unit}".rstrip())


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _struct_to_si(value: Any, kind: types.StructType, where: str, key: str) -> Any:
    if not isinstance(value, dict):
        raise ConfigError(f"{where}: {key or 'the file'} must be a section with keys, not {_describe(value)}")
    fields = {field.encode_name: field for field in kind.fields}
    for name in value:
        if name not in fields:
            hint = _ros_hint(str(name), kind, key) or name_hint(str(name), fields)
            raise ConfigError(f"{where}: unknown key {_join(key, name)!r:.100}{hint}")
    missing = [f.encode_name for f in kind.fields if f.required and f.encode_name not in value]
    if missing:
        raise ConfigError(f"{where}: {_join(key, missing[0])!r} is missing")
    return {name: _to_si(item, fields[name].type, where, _join(key, name)) for name, item in value.items()}


def _tagged_to_si(value: Any, members: list[types.StructType], where: str, key: str) -> Any:
    """Convert a section whose tag, such as `fault: freeze`, selects one of several structs."""
    by_tag, tag_field = {str(member.tag): member for member in members}, str(members[0].tag_field)
    if not isinstance(value, dict) or tag_field not in value:
        raise ConfigError(f"{where}: {key or 'it'} must be a section with the key {tag_field!r}")
    tag = str(value[tag_field])
    if tag not in by_tag:
        raise ConfigError(
            f"{where}: {_join(key, tag_field)}: unknown {tag_field} {tag!r:.60}{name_hint(tag, by_tag)}"
        )
    fields = {name: item for name, item in value.items() if name != tag_field}
    return {tag_field: tag, **_struct_to_si(fields, by_tag[tag], where, key)}


def _ros_hint(name: str, kind: types.StructType, key: str) -> str:
    """Return a hint to the key that has the meaning of a ROS package's key, from the structs' ROS_KEYS."""
    ros_keys: dict[str, tuple[str, str]] = getattr(kind.cls, "ROS_KEYS", {})
    if name in ros_keys:
        ours, meaning = ros_keys[name]
        return f" ({_join(key, ours)!r} is {meaning})"
    for field in kind.fields:
        inner = field.type
        if isinstance(inner, types.StructType) and (
            hint := _ros_hint(name, inner, _join(key, field.encode_name))
        ):
            return hint
    return ""


def _quantity(value: Any, unit: str, where: str, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ConfigError(f"{where}: {key} must be a quantity in {unit}, not {_describe(value)}")
    try:
        return to_si(str(value), unit)
    except UnitError as error:
        raise ConfigError(f"{where}: {key}: {error}") from None


def _join(key: str, name: Any) -> str:
    return f"{key}.{name}" if key else str(name)


def _describe(value: Any) -> str:
    return "nothing" if value is None else f"{type(value).__name__} {str(value)[:40]!r}"

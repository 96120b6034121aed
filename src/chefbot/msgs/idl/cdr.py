"""CDR serialization of messages, by functions that are generated from the definition of each type.

XCDR1, little endian, with Fast-CDR's layout: a primitive is aligned to its own size, counted from the end of
the four-byte encapsulation header (OMG CORBA 3.0, 15.3; DDSI-RTPS 2.5, 10.2).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import numpy as np

from chefbot.errors import ChefbotError
from chefbot.msgs.idl.codegen import FunctionSource
from chefbot.msgs.idl.fields import NUMPY_TYPES, MessageField, fields_of, ros_type
from chefbot.msgs.idl.precision import exact, float32_fields

if TYPE_CHECKING:
    from chefbot.msgs.idl.message import Message

M = TypeVar("M", bound="Message")
Chunk = bytes | memoryview
HEADER = b"\x00\x01\x00\x00"
_FORMATS = {
    "bool": "?", "byte": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip


class CdrError(ChefbotError):
    """Bytes that are not a valid message of the type, or values that do not fit their fields."""


def encode(message: Message) -> bytes:
    """Serialize a message to CDR; CdrError if a value does not fit its field."""
    parts: list[Chunk] = [HEADER]
    try:
        _writer(type(message))(parts, message, 0)
        return b"".join(parts)
    except (struct.error, AttributeError, TypeError, ValueError, OverflowError, CdrError) as error:
        raise CdrError(f"{ros_type(type(message))}: {error}") from error


def decode(kind: type[M], data: bytes) -> M:
    """Deserialize a message of type `kind`; CdrError if the bytes are invalid."""
    if data[:4] != HEADER:
        raise CdrError(f"{ros_type(kind)}: not little-endian CDR")
    try:
        message, end = _reader(kind)(data, 4)
    except (struct.error, UnicodeDecodeError, ValueError, IndexError, CdrError) as error:
        raise CdrError(f"{ros_type(kind)}: {error}") from error
    if len(data) - end > 8:  # peers may pad the end by at most one alignment
        raise CdrError(f"{ros_type(kind)}: {len(data) - end} bytes too many")
    return message


@cache
def _packers(format_codes: str) -> tuple[struct.Struct, ...]:
    """Return the structs of a run of primitives, with padding, for each of the eight possible offsets."""
    return tuple(struct.Struct("<" + _padded(format_codes, offset)) for offset in range(8))


def _padded(format_codes: str, offset: int) -> str:
    out = ""
    for code in format_codes:
        size = struct.calcsize("<" + code)
        gap = -offset % size
        out += "x" * gap + code
        offset += gap + size
    return out


def _raise_bad_length() -> NoReturn:
    raise CdrError("a length reaches beyond the bytes or its bound")


@cache
def _writer(kind: type[Message]) -> Callable[[list[Chunk], Message, int], int]:
    """Generate the function that appends a serialized message to `b`.

    Its `p`, the number of bytes so far after the header, is passed in and returned.
    """
    source = FunctionSource("def f(b, m, p):", refuse=_raise_bad_length, contiguous=np.ascontiguousarray)
    run: list[tuple[str, str]] = []
    _write_fields(source, kind, "m", run)
    _flush_writes(source, run)
    source.add("return p")
    return source.compile()


def _write_fields(
    source: FunctionSource, kind: type[Message], value: str, run: list[tuple[str, str]]
) -> None:
    for field in fields_of(kind):
        expression = f"{value}.{field.name}"
        if field.message is not None and not field.is_array:
            _write_fields(source, field.message, expression, run)
        elif not field.is_array and field.element != "string":
            run.append((_FORMATS[field.element], expression))
        else:
            _write_variable(source, field, expression, run)


def _write_variable(
    source: FunctionSource, field: MessageField, expression: str, run: list[tuple[str, str]]
) -> None:
    if field.element == "string" and not field.is_array:
        source.add(f"s = {expression}.encode()")
        if field.string_bound:
            source.add(f"if len(s) > {field.string_bound}: refuse()")
        run.append(("I", "len(s) + 1"))
        _flush_writes(source, run)
        source.add("b += (s, b'\\0'); p += len(s) + 1")
    elif field.element == "string" or field.message is not None:
        _write_items(source, field, expression, run)
    else:
        _write_numbers(source, field, expression, run)


def _write_items(
    source: FunctionSource, field: MessageField, expression: str, run: list[tuple[str, str]]
) -> None:
    source.add(f"v = {expression}")
    if field.bound:
        source.add(f"if len(v) > {field.bound}: refuse()")
    if field.fixed_size:
        source.add(f"if len(v) != {field.fixed_size}: refuse()")
    else:
        run.append(("I", "len(v)"))
    _flush_writes(source, run)
    writer = source.name(_write_string if field.message is None else _writer(field.message))
    source.add(f"for item in v: p = {writer}(b, item, p)")


def _write_numbers(
    source: FunctionSource, field: MessageField, expression: str, run: list[tuple[str, str]]
) -> None:
    dtype = np.dtype(NUMPY_TYPES[field.element])
    source.add(f"a = contiguous({expression}, {source.name(dtype)})")
    if field.fixed_size:
        source.add(f"if a.size != {field.fixed_size}:")
        source.add(f"    raise ValueError('{field.name} has not {field.fixed_size} elements')")
    else:
        run.append(("I", "a.size"))
    _flush_writes(source, run)
    source.add("if a.size:")
    if _may_need_padding(field):
        source.add(f"    g = -p % {dtype.itemsize}; b.append(bytes(g)); p += g")
    # large arrays are appended as a view, without a copy
    source.add("    b.append(a.data if a.size > 999 else a.tobytes()); p += a.nbytes")


def _may_need_padding(field: MessageField) -> bool:
    """Return whether padding may precede an array's numbers: after a 4-byte length, small ones need none."""
    return np.dtype(NUMPY_TYPES[field.element]).itemsize > (1 if field.fixed_size else 4)


def _flush_writes(source: FunctionSource, run: list[tuple[str, str]]) -> None:
    if not run:
        return
    table = source.name(_packers("".join(code for code, _ in run)))
    values = ", ".join(value for _, value in run)
    source.add(f"t = {table}[p & 7]; b.append(t.pack({values})); p += t.size")
    run.clear()


def _write_string(parts: list[Chunk], text: str, position: int) -> int:
    data = text.encode()
    packer = _packers("I")[position & 7]
    parts += (packer.pack(len(data) + 1), data, b"\0")
    return position + packer.size + len(data) + 1


@cache
def _reader(kind: type[Message]) -> Callable[[bytes, int], tuple[Any, int]]:
    source = FunctionSource("def f(d, p):", refuse=_raise_bad_length, frombuffer=np.frombuffer, exact=exact)
    run: list[tuple[str, str]] = []
    result = _read_fields(source, kind, "m", run)
    _flush_reads(source, run)
    floats = float32_fields(kind)
    if floats:
        source.add(f"exact[0] = m_{floats[0]}")
    source.add(f"m = {result}")
    if floats:
        source.add("exact[0] = None")
    source.add("return m, p")
    return source.compile()


def _read_fields(source: FunctionSource, kind: type[Message], prefix: str, run: list[tuple[str, str]]) -> str:
    """Generate the code that reads all fields, and return the expression that constructs the message."""
    arguments = []
    for field in fields_of(kind):
        target = f"{prefix}_{field.name}"
        if field.message is not None and not field.is_array:
            arguments.append(_read_fields(source, field.message, target, run))
            continue
        if not field.is_array and field.element != "string":
            run.append((_FORMATS[field.element], target))
        else:
            _read_variable(source, field, target, run)
        arguments.append(target)
    return f"{source.name(kind)}({', '.join(arguments)})"


def _read_variable(
    source: FunctionSource, field: MessageField, target: str, run: list[tuple[str, str]]
) -> None:
    if not field.fixed_size:
        run.append(("I", "n"))
    _flush_reads(source, run)
    if field.element == "string" and not field.is_array:
        source.add("if n > len(d) - p: refuse()")
        source.add(f"{target} = d[p : p + n - (n > 0)].decode(); p += n")
    elif field.element == "string" or field.message is not None:
        _read_items(source, field, target)
    else:
        _read_numbers(source, field, target)


def _read_items(source: FunctionSource, field: MessageField, target: str) -> None:
    reader = source.name(_read_string if field.message is None else _reader(field.message))
    if field.fixed_size:
        source.add(f"n = {field.fixed_size}")
    max_length = f"min({field.bound}, len(d) - p)" if field.bound else "len(d) - p"
    source.add(f"if n > {max_length}: refuse()")
    source.add("v = []")
    source.add("for _ in range(n):")
    source.add(f"    item, p = {reader}(d, p)")
    source.add("    v.append(item)")
    source.add(f"{target} = tuple(v)")


def _read_numbers(source: FunctionSource, field: MessageField, target: str) -> None:
    dtype = np.dtype(NUMPY_TYPES[field.element])
    dtype_name, empty = source.name(dtype), source.name(np.empty(0, dtype))
    if field.fixed_size:
        source.add(f"n = {field.fixed_size}")
    if _may_need_padding(field):
        source.add(f"if n: p += -(p - 4) % {dtype.itemsize}")
    source.add(f"if n * {dtype.itemsize} > len(d) - p: refuse()")
    source.add(f"{target} = frombuffer(d, {dtype_name}, n, p) if n else {empty}")
    source.add(f"p += n * {dtype.itemsize}")


def _flush_reads(source: FunctionSource, run: list[tuple[str, str]]) -> None:
    if not run:
        return
    table = source.name(_packers("".join(code for code, _ in run)))
    source.add(f"s = {table}[(p - 4) & 7]")
    source.add(f"{', '.join(target for _, target in run)}, = s.unpack_from(d, p)")
    source.add("p += s.size")
    run.clear()


def _read_string(data: bytes, position: int) -> tuple[str, int]:
    """Read a string, whose length includes the terminating zero; length 0 means empty, as in Fast-CDR."""
    packer = _packers("I")[(position - 4) & 7]
    (length,) = packer.unpack_from(data, position)
    position += packer.size
    if length > len(data) - position:
        _raise_bad_length()
    return data[position : position + length - (length > 0)].decode(), position + length

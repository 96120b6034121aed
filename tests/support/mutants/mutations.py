"""Mutations of valid files by seed: of bytes, of tokens and lines, and of the structure of each format."""

from __future__ import annotations

import base64
import gzip
import json
import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

import yaml
import zstandard

Mutation = Callable[[bytes, Random], bytes]

NASTY_TOKENS = [
    "", "~", "null", "nan", ".nan", ".inf", "-.inf", "-0", "0", "-1", "1e309", "1e-320", "9" * 400,
    "0x7fffffff", "2**31",
    "4294967296", "18446744073709551616", "true", "[]", "{}", "[[[[]]]]", "&a [*a]", "*a", "<<: {a: 1}",
    "!!binary eA==",
    "!!python/object:os.system x", "!!set {a}", "!!timestamp 2020-13-45", "2020-13-45", "1:99:99", "? [a]",
    "'", '"', "#",
    "a" * 300, "../../etc/passwd", "/dev/zero", "/dev/stdin", "/etc/shadow", ".", "..", "/", "~",
    "~nobody/x", "\0", "\x1b[2J",
    "\u202e", "\ufeff", "\udcff", "%s%n", "{0.__class__}", "${x}", "${9**9**9}", "$(find x)", "-5 m",
    "1e400 m", "1 parsec",
    "5 kg", "1 m m", "1/0 m", "NaN deg", "\r", "\t", "<a>", "]]>", "&amp;", "&x;", "<!DOCTYPE a [<!ENTITY b 'c'>]>",
]  # fmt: skip
NASTY_VALUES: list[Any] = [
    None, True, False, 0, -1, 1, 10**40, -(10**400), 1e308, -1e-320, float("nan"), float("inf"), "",
    "a" * 300, "\0", "\x1b[1m",
    "../x", "/dev/zero", "1 m", "-3 deg", "nan m", "1e400 s", [], {}, [[]], [None], {"a": None}, {"": ""},
    {"x": {"x": {"x": 1}}},
    [0] * 1000, "\u202e", "0.5", "home", "~/x",
]  # fmt: skip


def any_bytes(data: bytes, rng: Random) -> bytes:
    """One to four changes of bytes: flipped, cut, repeated, inserted, overwritten, cut off."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        end = min(end, at + rng.choice((1, 4, 60, 1000)))
        noise = rng.randbytes(rng.choice((1, 4, 40)))
        data = rng.choice((
            data[:at] + bytes(byte ^ (1 << rng.randrange(8)) for byte in data[at : at + 1]) + data[at + 1 :],
            data[:at] + data[end:],
            data[:end] + data[at:end] * rng.choice((1, 2, 50)) + data[end:],
            data[:at] + noise + data[at:],
            data[:at] + rng.choice((b"\0", b"\xff", noise[:1])) * (end - at) + data[end:],
            data[:at],
        ))  # fmt: skip
    return data


def encoded(data: bytes, rng: Random) -> bytes:
    """The same text with another mark, encoding or line end; or almost nothing."""
    text = data.decode(errors="replace")
    return rng.choice((
        b"\xef\xbb\xbf" + data, text.encode("utf-16"), text.encode("utf-32"), data.replace(b"\n", b"\r\n"),
        data.replace(b"\n", b"\r"), data.replace(b" ", b"\t"), b"", b"\n", b"\0", data + b"\0", data * 2, data[::-1],
        text.encode("latin-1", "replace") + b"\xe9",
    ))  # fmt: skip


def tokens(data: bytes, rng: Random) -> bytes:
    """A token or a line of a text is replaced, removed, repeated or swapped with another."""
    lines = data.decode(errors="surrogateescape").split("\n")
    for _ in range(rng.choice((1, 1, 2, 3))):
        at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        kind = rng.randrange(6)
        if kind < 3:
            lines[at] = _other_token(lines[at], rng)
        elif kind == 3:
            lines[at], lines[other] = lines[other], lines[at]
        elif kind == 4:
            lines.insert(at, lines[other])
        else:
            lines[at] = rng.choice(
                (" " + lines[at], lines[at].lstrip(), "", "- " + lines[at], lines[at] + ":")
            )
    return "\n".join(lines).encode(errors="surrogateescape")


def _other_token(line: str, rng: Random) -> str:
    """The line with one of its tokens replaced by a nasty one; tokens end at spaces, brackets and quotes."""
    parts = _split(line)
    if not parts:
        return rng.choice(NASTY_TOKENS)
    parts[rng.randrange(len(parts))] = rng.choice(NASTY_TOKENS)
    return "".join(parts).encode(errors="surrogateescape").decode(errors="surrogateescape")


def _split(line: str) -> list[str]:
    parts, token = [], ""
    for letter in line:
        if letter in " ,:[]{}()<>\"'=/":
            parts += [token, letter] if token else [letter]
            token = ""
        else:
            token += letter
    return [*parts, token] if token else parts


class _AnyTag(yaml.SafeLoader):
    """A loader of tags that only xacro knows, as `!degrees 30`: their texts."""


_AnyTag.add_constructor("!degrees", lambda _loader, node: node.value)


def yaml_tree(data: bytes, rng: Random) -> bytes:
    """A value or a key anywhere in a YAML file is replaced, removed, renamed or repeated."""
    tree = yaml.load(data, Loader=_AnyTag)
    for _ in range(rng.choice((1, 1, 2))):
        tree = changed_tree(tree, rng)
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True, width=500).encode(
        errors="surrogateescape"
    )


def json_tree(data: bytes, rng: Random) -> bytes:
    """As `yaml_tree`, of a JSON file."""
    return json.dumps(changed_tree(json.loads(data), rng)).encode()


def changed_tree(tree: Any, rng: Random) -> Any:
    """Return dicts and lists with one change somewhere below."""
    holders = [tree, *(below for below in _below(tree) if isinstance(below, dict | list) and below)]
    holder = rng.choice(holders)
    if not isinstance(holder, dict | list) or not holder or rng.random() < 0.02:
        return rng.choice(NASTY_VALUES)
    key = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    value = holder[key]
    kind = rng.randrange(6)
    if kind < 3:
        holder[key] = rng.choice(NASTY_VALUES) if not _is_number(value) or kind else _other_number(value, rng)
    elif kind == 3:
        del holder[key]
    elif isinstance(holder, list):
        holder.extend([value] * rng.choice((1, 30)))
    else:
        holder[rng.choice((f"{key}s", str(key)[:-1], *NASTY_TOKENS))] = value
    return tree


def _below(tree: Any) -> list[Any]:
    children = list(tree.values()) if isinstance(tree, dict) else tree if isinstance(tree, list) else []
    return [part for child in children for part in (child, *_below(child))]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _other_number(value: float, rng: Random) -> float:
    if not -1e300 < value < 1e300:  # NaN and what no float holds
        return rng.choice((-value, 0))
    return rng.choice((-value, value * 1e6, value * 1e-6, value + 1, 0, int(value), value * 1e300))


def xml_tree(data: bytes, rng: Random) -> bytes:
    """An attribute, an element or a text of an XML file is replaced, removed, moved or repeated."""
    root = ET.fromstring(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        holder, other = rng.choice(list(root.iter())), rng.choice(list(root.iter()))
        kind = rng.randrange(6)
        if kind < 2 and holder.attrib:
            holder.set(rng.choice(list(holder.attrib)), _printable(rng.choice(NASTY_TOKENS)))
        elif kind == 2 and holder.attrib:
            del holder.attrib[rng.choice(list(holder.attrib))]
        elif kind == 3 and len(holder):
            holder.remove(rng.choice(list(holder)))
        elif kind == 4 and other not in holder.iter() and holder not in other.iter():
            holder.append(other)
        else:
            holder.text = _printable(rng.choice(NASTY_TOKENS))
    return ET.tostring(root)


def _printable(text: str) -> str:
    return "".join(letter for letter in text if letter >= " " and not "\ud800" <= letter <= "\udfff")


def png_chunks(data: bytes, rng: Random) -> bytes:
    """A chunk of a PNG is changed, removed, repeated or inserted; its checksum is right, mostly."""
    chunks = _png_chunks(data)
    at, kind = rng.randrange(len(chunks)), rng.randrange(5)
    name, body = chunks[at]
    if kind == 0 and name == b"IHDR":
        body = struct.pack(">IIBBBBB", *(rng.choice((0, 1, 8, 16, 100, 20000, 2**31 - 1)) for _ in range(2)),
                           *(rng.choice((0, 1, 2, 3, 4, 6, 8, 16)) for _ in range(5)))  # fmt: skip
        chunks[at] = (name, body)
    elif kind == 1:
        chunks[at] = (name, any_bytes(body or b"\0", rng))
    elif kind == 2 and name == b"IDAT":
        chunks[at] = (name, zlib.compress(bytes(rng.choice((0, 10, 10_000_000)))))
    elif kind == 3:
        known = (
            b"iCCP",
            b"zTXt",
            b"iTXt",
            b"tEXt",
            b"tRNS",
            b"PLTE",
            b"acTL",
            b"fdAT",
            b"eXIf",
            b"gAMA",
            b"pHYs",
            b"IDAT",
        )
        noise = (
            b"a\0\0" + zlib.compress(bytes(rng.choice((10, 50_000_000))))
            if rng.random() < 0.3
            else rng.randbytes(20)
        )
        chunks.insert(at, (rng.choice(known), noise))
    else:
        chunks.pop(at)
    return data[:8] + b"".join(_png_chunk(*chunk, rng.random() < 0.1) for chunk in chunks)


def _png_chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    chunks, at = [], 8
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        chunks.append((name, data[at + 8 : at + 8 + size]))
        at += size + 12
    return chunks


def _png_chunk(name: bytes, body: bytes, wrong: bool) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body) ^ wrong)


def pgm_header(data: bytes, rng: Random) -> bytes:
    """The magic, a size or the white of a PGM is another."""
    magic, width, height, white_and_pixels = data.split(None, 3)
    parts = [magic, width, height]
    parts[rng.randrange(3)] = rng.choice(
        (b"P2", b"P5", b"P6", b"0", b"-1", b"1", b"99999", b"4294967296", b"x", b"#", b"1" * 30)
    )
    return b"\n".join([*parts, white_and_pixels])


def gzipped(inner: Mutation) -> Mutation:
    """Mutate what is in a gzip file, or now and then put very much into it."""

    def mutation(data: bytes, rng: Random) -> bytes:
        text = gzip.decompress(data)
        content = bytes(100_000_000) if rng.random() < 0.005 else inner(text, rng)
        return gzip.compress(content, compresslevel=1, mtime=0)

    return mutation


def mcap_records(data: bytes, rng: Random) -> bytes:
    """A record of an MCAP file, also within a chunk, is changed, removed, repeated or moved."""
    records = _records(data[8:-8])
    chunks = [number for number, (code, _) in enumerate(records) if code == 6]
    if chunks and rng.random() < 0.6:
        number = rng.choice(chunks)
        records[number] = (6, _other_chunk(records[number][1], rng))
    else:
        _change_record(records, rng)
    return data[:8] + b"".join(_record(*record) for record in records) + data[-8:]


def _records(data: bytes) -> list[tuple[int, bytes]]:
    records, at = [], 0
    while at + 9 <= len(data):
        code, size = struct.unpack_from("<BQ", data, at)
        records.append((code, data[at + 9 : at + 9 + size]))
        at += 9 + size
    return records


def _record(code: int, body: bytes) -> bytes:
    return struct.pack("<BQ", code, len(body)) + body


def _change_record(records: list[tuple[int, bytes]], rng: Random) -> None:
    at, other = rng.randrange(len(records)), rng.randrange(len(records))
    code, body = records[at]
    kind = rng.randrange(6)
    if kind < 3:
        records[at] = (code, any_bytes(body or b"\0", rng))
    elif kind == 3:
        records.insert(other, records[at])
    elif kind == 4:
        records[at] = (rng.choice((0, 1, 3, 4, 5, 6, 8, 11, 12, 15, 99, 255)), body)
    else:
        records.pop(at)


def _other_chunk(body: bytes, rng: Random) -> bytes:
    """A chunk with other records in it; its sizes and its checksum (0: none) fit, mostly."""
    start, end, _, _, length = struct.unpack_from("<QQQII", body, 0)
    name = body[32 : 32 + length]
    packed = body[40 + length :]
    plain = zstandard.ZstdDecompressor().decompress(packed) if name == b"zstd" else packed
    records = _records(plain)
    for _ in range(rng.choice((1, 1, 3))):
        _change_record(records, rng)
        records = records or _records(plain)
    plain = bytes(80_000_000) if rng.random() < 0.03 else b"".join(_record(*record) for record in records)
    size = rng.choice((len(plain),) * 8 + (0, 1, 2**31, 2**63))
    name = rng.choice((name,) * 12 + (b"", b"lz4", b"gzip", b"\xff"))
    packed = zstandard.ZstdCompressor(level=1).compress(plain)
    head = struct.pack("<QQQII", start, end, size, rng.choice((0, 0, 0, 1)), len(name))
    return head + name + struct.pack("<Q", len(packed)) + packed


def pem(data: bytes, rng: Random) -> bytes:
    """The bytes within a PEM block are others; the block's form is right."""
    head, *lines, tail = data.decode().strip().split("\n")
    inner = any_bytes(base64.b64decode("".join(lines)), rng)
    text = base64.b64encode(inner).decode()
    return "\n".join([head, *(text[at : at + 64] for at in range(0, len(text), 64)), tail, ""]).encode()

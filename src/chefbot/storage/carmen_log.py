"""The text of a CARMEN log on disk, gzip-compressed or not."""

from __future__ import annotations

import contextlib
import gzip
import io
import zlib
from pathlib import Path
from typing import NamedTuple

from chefbot.config import read_bytes
from chefbot.errors import UserError

MAX_LOG_BYTES = 2_000_000_000
MAX_RATIO, FREE_BYTES = 20, 4_000_000
"""A compressed log may unpack to this many times its size, and some bytes more; gzip packs such text 3 to 8 times."""
_BLOCK = 1_000_000


class LogText(NamedTuple):
    """The text of a log, and a sentence about what is missing of it, or an empty string."""

    text: str
    note: str


def read_text(path: Path) -> LogText:
    """Return the text of a log, gzip-compressed or not; of a cut-off file what it has.

    Raises UserError if it is not ASCII text.
    """
    data, note = read_bytes(path, "log", MAX_LOG_BYTES), ""
    try:
        if data[:2] == b"\x1f\x8b":
            data, complete = _bounded_gunzip(data, path)
            note = "" if complete else "The gzip file is cut off; what it has is used."
        return LogText(data.decode("ascii"), note)
    except (OSError, zlib.error) as error:
        raise UserError(f"log {path} is a damaged gzip file: {error}") from None
    except UnicodeDecodeError:
        kind = "is a damaged gzip file" if note else "is not a CARMEN log"
        raise UserError(f"log {path} {kind}: it is not text") from None


def _bounded_gunzip(data: bytes, path: Path) -> tuple[bytes, bool]:
    """Return what a file decompresses to, and whether it is complete; of a cut-off one what it has.

    It is decompressed block by block up to a limit: a small file can contain an enormous one.
    """
    limit = min(MAX_LOG_BYTES, MAX_RATIO * len(data) + FREE_BYTES)
    blocks, size, complete = [], 0, False
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file, contextlib.suppress(EOFError):
        while block := file.read1(_BLOCK):
            blocks.append(block)
            size += len(block)
            if size > limit:
                raise UserError(
                    f"log {path} unpacks to more than {limit} bytes; that is not a log of laser scans"
                )
        complete = True
    return b"".join(blocks), complete

"""The text of a CARMEN log on disk, gzip-compressed or not."""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path

from chefbot.config import read_bytes
from chefbot.errors import UserError

MAX_LOG_BYTES = 2_000_000_000
MAX_RATIO, FREE_BYTES = 20, 4_000_000
"""A compressed log may unpack to this many times its size, and some bytes more; gzip packs such text 3 to 8 times."""
_BLOCK = 1_000_000


def read_text(path: Path) -> str:
    """Return the text of a log, gzip-compressed or not. Raises UserError if it is not ASCII text."""
    data = read_bytes(path, "log", MAX_LOG_BYTES)
    try:
        if data[:2] == b"\x1f\x8b":
            data = _bounded_gunzip(data, path)
        return data.decode("ascii")
    except (OSError, EOFError, zlib.error) as error:
        raise UserError(f"log {path} is a damaged or cut-off gzip file: {error}") from None
    except UnicodeDecodeError:
        raise UserError(f"log {path} is not a CARMEN log: it is not text") from None


def _bounded_gunzip(data: bytes, path: Path) -> bytes:
    """Decompress block by block up to a limit: a small file can contain an enormous one."""
    limit = min(MAX_LOG_BYTES, MAX_RATIO * len(data) + FREE_BYTES)
    blocks, size = [], 0
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        while block := file.read(_BLOCK):
            blocks.append(block)
            size += len(block)
            if size > limit:
                raise UserError(
                    f"log {path} unpacks to more than {limit} bytes; that is not a log of laser scans"
                )
    return b"".join(blocks)

"""The text of a CARMEN log on disk, gzip-compressed or not."""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path

from chefbot.config import read_bytes
from chefbot.errors import UserError

MAX_LOG_BYTES = 2_000_000_000


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
    """Decompress at most MAX_LOG_BYTES: a small file can contain an enormous one."""
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        text = file.read(MAX_LOG_BYTES + 1)
    if len(text) > MAX_LOG_BYTES:
        raise UserError(
            f"log {path} unpacks to more than {MAX_LOG_BYTES} bytes; that is not a log of laser scans"
        )
    return text

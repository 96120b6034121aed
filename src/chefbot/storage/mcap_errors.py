"""The exceptions of reading MCAP files."""

from __future__ import annotations

import struct

from mcap.exceptions import McapError
from zstandard import ZstdError

READ_ERRORS = (
    McapError, ZstdError, struct.error, ValueError, EOFError, KeyError, IndexError, MemoryError, OverflowError,
)  # fmt: skip
"""Exceptions that the mcap library raises for a file that is truncated or corrupt."""

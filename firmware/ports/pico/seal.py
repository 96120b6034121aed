"""Gives a Pico program the CRC that the boot ROM wants: seal.py IN.bin OUT.bin.

CRC-32 without reflection (polynomial 0x04C11DB7, start 0xFFFFFFFF) over the first 252 bytes: RP2040 data sheet,
2.8.1.3.1.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path


def crc32(data: bytes) -> int:
    rest = 0xFFFFFFFF
    for byte in data:
        rest ^= byte << 24
        for _ in range(8):
            rest = ((rest << 1) ^ (0x04C11DB7 if rest & 0x80000000 else 0)) & 0xFFFFFFFF
    return rest


def sealed(image: bytes) -> bytes:
    assert image[248:256] == bytes(8), "the boot stage leaves no room for its CRC"
    return image[:252] + struct.pack("<I", crc32(image[:252])) + image[256:]


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    target.write_bytes(sealed(source.read_bytes()))

"""Gives a Pico program the CRC that the boot ROM wants, and packs it as UF2: seal.py IN.bin OUT.bin OUT.uf2.

CRC-32 without reflection (polynomial 0x04C11DB7, start 0xFFFFFFFF) over the first 252 bytes: RP2040 data sheet,
2.8.1.3.1. UF2: github.com/microsoft/uf2, family RP2040.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

FLASH = 0x10000000
FAMILY_RP2040 = 0xE48BFF56
BLOCK = 256


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


def uf2(image: bytes) -> bytes:
    blocks = [image[i : i + BLOCK].ljust(BLOCK, b"\0") for i in range(0, len(image), BLOCK)]
    return b"".join(
        struct.pack(
            "<8I", 0x0A324655, 0x9E5D5157, 0x2000, FLASH + i * BLOCK, BLOCK, i, len(blocks), FAMILY_RP2040
        )
        + block.ljust(476, b"\0")
        + struct.pack("<I", 0x0AB16F30)
        for i, block in enumerate(blocks)
    )


def main() -> None:
    source, target, packed = map(Path, sys.argv[1:])
    image = sealed(source.read_bytes())
    target.write_bytes(image)
    packed.write_bytes(uf2(image))


if __name__ == "__main__":
    main()

"""Prints the flash and RAM of a program: sizes.py SIZE-TOOL LABEL ELF MOST_FLASH; fails above MOST_FLASH bytes."""

# ruff: noqa: T201
from __future__ import annotations

import subprocess
import sys


def main() -> int:
    tool, label, elf, most = sys.argv[1:]
    done = subprocess.run([tool, elf], check=True, capture_output=True, text=True)
    text, data, bss = map(int, done.stdout.splitlines()[1].split()[:3])
    print(f"{label}: {text + data} bytes of flash (at most {most}), {data + bss} of RAM without stack")
    return 1 if text + data > int(most) else 0


if __name__ == "__main__":
    sys.exit(main())

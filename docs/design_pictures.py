"""The documentation's pictures of drawings and solids, made by the verbs that everyone uses.

python docs/design_pictures.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

PICTURES = Path(__file__).parent / "pictures"
WIDTH = 1200  # pixels


def main() -> None:
    """base_plate.png, assembly.png and assembled.png in docs/pictures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        chefbot("drawing", "base_plate", "assembly", "--out", name)
        chefbot("model", "--format", "glb", "--out", str(folder / "assembled.glb"))
        for picture in ("base_plate", "assembly", "assembled"):
            shrink(folder / f"{picture}.png", PICTURES / f"{picture}.png")


def chefbot(*arguments: str) -> None:
    """Run a verb as a user would."""
    subprocess.run([sys.executable, "-m", "chefbot", *arguments], check=True)


def shrink(source: Path, target: Path) -> None:
    """At most WIDTH wide, few colours: drawings have no more."""
    with Image.open(source) as image:
        image.thumbnail((WIDTH, WIDTH))
        image.convert("RGB").quantize(128).save(target, optimize=True)


if __name__ == "__main__":
    main()

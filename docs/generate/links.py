"""Links of the Markdown files, which work on GitHub, made to work in the site."""

from __future__ import annotations

import os
import re
from pathlib import Path

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
REPOSITORY = "https://github.com/chefbot/chefbot/blob/main/"
MIRRORED = {
    "readme": "README.md",
    "firmware": "firmware/README.md",
    "contributing": "CONTRIBUTING.md",
    "changelog": "CHANGELOG.md",
    "security": "SECURITY.md",
}
"""Pages of the site that show a file from outside `docs`, by name."""
_LINK = re.compile(r"(\]\()([^)\s#]*)(#[^)\s]*)?(\))")


def rewrite_links(text: str, path: Path, page: str) -> str:
    """Return the text of the file `path`, shown as `page`, with its relative links changed.

    Targets in docs/ become relative to the page, mirrored files become their pages, and all other files of the
    repository become links to the repository's web page.
    """
    here = (DOCS / page).parent
    mirrors = {(ROOT / file).resolve(): DOCS / f"{name}.md" for name, file in MIRRORED.items()}

    def replace(match: re.Match[str]) -> str:
        target, anchor = match[2], match[3] or ""
        if not target or "://" in target or target.startswith("mailto:"):
            return match[0]
        found = (path.parent / target).resolve()
        found = mirrors.get(found, found)
        if not found.is_relative_to(DOCS) or (
            found.suffix not in (".md", ".rst") and "pictures" not in found.parts
        ):
            return (
                f"]({REPOSITORY}{found.relative_to(ROOT)}{anchor})"
                if found.is_relative_to(ROOT)
                else match[0]
            )
        return f"]({os.path.relpath(found, here)}{anchor})"

    return _LINK.sub(replace, text)

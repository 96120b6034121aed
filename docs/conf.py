"""Sphinx configuration; the reference is generated from the code at each build (docs/generate)."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path[:0] = [str(DOCS), str(ROOT / "src")]

from generate.__main__ import write_all
from generate.api import class_index
from generate.links import MIRRORED, rewrite_links

from sphinx import addnodes

from chefbot import __version__

project = "chefbot"
author = "the chefbot developers"
copyright = "the chefbot developers, Apache-2.0"
version = release = __version__

extensions = ["myst_parser", "sphinx_design"]
exclude_patterns = ["_build", "**/__pycache__"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_enable_extensions = ["colon_fence", "dollarmath", "deflist"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
suppress_warnings = ["myst.header"]
highlight_language = "text"
nitpicky = False
add_module_names = False
python_display_short_literal_types = True
maximum_signature_line_length = 100

html_theme = "furo"
html_title = f"chefbot {release}"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "source_repository": "https://github.com/chefbot/chefbot/",
    "source_branch": "main",
    "source_directory": "docs/",
}


def _generate(_app: Any) -> None:
    write_all(DOCS / "reference" / "generated")


def _mirrored_pages(*_: Any) -> list[str]:
    """Read mirrored pages at each build, as Sphinx does not see changes of files outside `docs`."""
    return list(MIRRORED)


def _read_source(_app: Any, name: str, content: list[str]) -> None:
    """Show files from outside `docs` on their mirror pages, and point links at pages of the site."""
    path = DOCS / f"{name}.md"
    if name in MIRRORED:
        path = ROOT / MIRRORED[name]
        content[0] = path.read_text()
    if path.exists():
        text = re.sub(r"^```sh$", "```bash", content[0], flags=re.MULTILINE)
        content[0] = rewrite_links(text, path, name)


CLASSES = class_index()


def _link_types(_app: Any, doctree: Any) -> None:
    """Link the classes of annotations by their full names; Sphinx would search all names for each of them."""
    for node in list(doctree.findall(addnodes.pending_xref)):
        if node.get("refdomain") == "py":
            full_name = CLASSES.get(node["reftarget"].rpartition(".")[2])
            if full_name is None:
                node.replace_self(node.children)
            else:
                node["reftarget"] = full_name
                node.attributes.pop("refspecific", None)


def setup(app: Any) -> None:
    """Register the generator and the reader of mirrored pages."""
    app.connect("builder-inited", _generate)
    app.connect("env-get-outdated", _mirrored_pages)
    app.connect("doctree-read", _link_types)
    app.connect("source-read", _read_source)

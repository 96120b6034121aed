"""Checks a built site: `python -m tests.support.links docs/_build` lists broken links and unreachable pages.

A link is broken if its file is missing or the file has no element with the id of its anchor. A page is unreachable if
no chain of links in the pages' main text or navigation leads to it from index.html. Links to other sites are not
followed. The exit code is 1 if anything is listed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

LINKS = {"a": "href", "img": "src", "link": "href", "script": "src", "source": "src", "object": "data"}
GENERATED_BY_SPHINX = ("genindex.html", "search.html", "py-modindex.html")
"""Pages that Sphinx adds; their links are checked, but no page has to lead to them."""


class Page(NamedTuple):
    """The links and the anchors of one HTML file."""

    links: list[str]
    anchors: set[str]


class _Parser(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.page = Page([], set())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        target = values.get(LINKS.get(tag, ""))
        if target:
            self.page.links.append(target)
        self.page.anchors.update(value for key in ("id", "name") if (value := values.get(key)))


def read_site(folder: Path) -> dict[Path, Page]:
    """Return the pages below a folder by their resolved paths."""
    pages = {}
    for path in sorted(folder.rglob("*.html")):
        if "_static" not in path.relative_to(folder).parts:
            parser = _Parser()
            parser.feed(path.read_text(encoding="utf-8"))
            pages[path.resolve()] = parser.page
    return pages


def target_of(path: Path, link: str) -> tuple[Path, str] | None:
    """Return file and anchor of a link on the page `path`; None for a link to another site."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return None
    file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    return (file / "index.html" if file.is_dir() else file), unquote(parts.fragment)


def broken_links(pages: dict[Path, Page]) -> Iterator[str]:
    """Yield a sentence for each link whose file or anchor does not exist."""
    for path, page in pages.items():
        for link in sorted(set(page.links)):
            target = target_of(path, link)
            if target is None:
                continue
            file, anchor = target
            if not file.exists():
                yield f"{path.name}: {link} leads to a file that does not exist"
            elif anchor and file in pages and anchor not in pages[file].anchors:
                yield f"{path.name}: {link} leads to an anchor that does not exist"


def unreachable_pages(pages: dict[Path, Page], start: Path) -> Iterator[str]:
    """Yield a sentence for each page that no chain of links from `start` leads to."""
    reached, queue = {start}, [start]
    while queue:
        path = queue.pop()
        targets = {target[0] for link in pages[path].links if (target := target_of(path, link))}
        new = (targets & pages.keys()) - reached
        reached |= new
        queue += new
    for path in sorted(pages.keys() - reached):
        if path.name not in GENERATED_BY_SPHINX:
            yield f"{path.relative_to(start.parent)}: no link from index.html leads here"


def problems(folder: Path) -> list[str]:
    """Return all problems of the site in a folder, in sentences."""
    pages, start = read_site(folder), (folder / "index.html").resolve()
    if start not in pages:
        return [f"{folder}: there is no index.html; build the site with `make docs`"]
    return [*broken_links(pages), *unreachable_pages(pages, start)]


def main() -> int:
    """Print the problems of the folder on the command line."""
    found = problems(Path(sys.argv[1]))
    sys.stdout.writelines(f"{line}\n" for line in found)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

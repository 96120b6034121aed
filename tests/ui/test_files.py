"""Tests of how the files of the web UI are served: compressed, and not again to who has them."""

from __future__ import annotations

import gzip
from typing import Any

import httpx
import pytest

from chefbot.ui.files import static_files

SMALL_3D = 700_000
"""Maximum size of all files, compressed, bytes."""


@pytest.mark.parametrize("path", ["", "app.js", "vendor/three/three.core.min.js"])
def test_a_file_is_compressed_if_the_browser_takes_that(page: Any, path: str) -> None:
    content = static_files()[path or "index.html"]
    plain = httpx.get(page.url + path, headers={"accept-encoding": "identity"})
    assert plain.content == content and "content-encoding" not in plain.headers
    with httpx.stream("GET", page.url + path, headers={"accept-encoding": "gzip"}) as answer:
        raw = b"".join(answer.iter_raw())
        assert answer.headers["content-encoding"] == "gzip"
    assert gzip.decompress(raw) == content and len(raw) < 0.6 * len(content)


def test_a_file_that_the_browser_has_is_not_sent_again(page: Any) -> None:
    first = httpx.get(page.url)
    tag = first.headers["etag"]
    for known in (tag, f'"other", W/{tag}'):
        again = httpx.get(page.url, headers={"if-none-match": known})
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["content-security-policy"] == first.headers["content-security-policy"]
    assert httpx.get(page.url, headers={"if-none-match": '"other"'}).status_code == 200
    assert httpx.get(page.url + "app.js").headers["etag"] != tag


def test_the_whole_web_ui_is_small() -> None:
    assert sum(len(gzip.compress(content)) for content in static_files().values()) < SMALL_3D

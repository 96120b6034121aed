"""Static files of the web UI, and the HTTP headers with which they are served."""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

FOLDER = Path(__file__).parent / "static"
TYPES = {
    "html": "text/html",
    "css": "text/css",
    "js": "text/javascript",
    "svg": "image/svg+xml",
    "json": "application/json",
    "png": "image/png",
}
POLICY = (
    "default-src 'none'; script-src 'self'{hashes}; style-src 'self'; connect-src 'self'; "
    "img-src 'self' blob: data:; manifest-src 'self'; worker-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content Security Policy of the web UI."""
SECURITY_HEADERS = {
    "content-security-policy": POLICY.format(hashes=""),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-cache",
}
"""HTTP headers of every response."""
_INLINE_SCRIPT = re.compile(rb'<script(?: type="importmap")?>(.*?)</script>', re.DOTALL)


def static_files() -> dict[str, bytes]:
    """Return all files by path, read once: only files in this dict are served."""
    files = {path.relative_to(FOLDER).as_posix(): path for path in FOLDER.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if path.suffix[1:] in TYPES}


def served_files() -> dict[str, Content]:
    """Return the static files by path as they are served."""
    return {
        name: Content(content, content_type(name), response_headers(content))
        for name, content in static_files().items()
    }


def content_type(path: str) -> str:
    """Return the media type for the file name's extension."""
    return TYPES[path.rsplit(".")[-1]]


def plain_text(text: str, status: int) -> Response:
    """Return an answer that is a sentence, such as why there is no file."""
    return Response(text, status, SECURITY_HEADERS, "text/plain")


def response_headers(content: bytes) -> dict[str, str]:
    """Return the HTTP headers of a file: the only inline scripts that may run are its own, identified by their
    hashes.

    They are the import map, which browsers take from the page itself only (HTML Living Standard, "Import maps"), and
    what loads the page again if a file did not arrive. A policy allows a script of a page by the hash of its text
    (W3C, Content Security Policy Level 3, "hash-source").
    """
    digests = [hashlib.sha256(text).digest() for text in _INLINE_SCRIPT.findall(content)]
    hashes = "".join(f" 'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return SECURITY_HEADERS | {"content-security-policy": POLICY.format(hashes=hashes)}


@lru_cache(128)  # the servers of one process serve the same files
def _compressed(content: bytes) -> bytes:
    return gzip.compress(content, mtime=0)


class Content:
    """A file that is served: compressed where the browser takes that, and not sent again if it has it already."""

    def __init__(self, content: bytes, media_type: str, headers: Mapping[str, str]) -> None:
        self._content, self._media_type = content, media_type
        # Here, because at a request it would delay an emergency stop.
        self._compressed = _compressed(content)
        tag = hashlib.sha256(content).hexdigest()[:32]
        self._headers = {**headers, "etag": f'"{tag}"', "vary": "accept-encoding"}

    def response(self, request: Request) -> Response:
        """Return the answer to a request: 304 if the browser has this very content (RFC 9110, 13.1.2)."""
        known = (
            tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")
        )
        if self._headers["etag"] in known:
            return Response(status_code=304, headers=self._headers)
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(self._content, 200, self._headers, self._media_type)
        headers = {**self._headers, "content-encoding": "gzip"}
        return Response(self._compressed, 200, headers, self._media_type)

"""The answer to a request that is refused: a page in the reader's language for a person, else one line of text."""

from __future__ import annotations

import base64
import hashlib
import html
from collections.abc import Iterator
from functools import lru_cache

import msgspec
from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response

from chefbot.ui.files import FOLDER, SECURITY_HEADERS

STYLE = (
    "body{font:1.3rem/1.5 system-ui,sans-serif;max-width:34rem;margin:0 auto;padding:20vh 1.5rem;"
    "color-scheme:light dark}"
    "h1{font-size:1rem;font-weight:500;opacity:.7}"
)
"""The style sheet of the page, which has no file of its own: a stranger gets none."""
STYLE_HASH = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
POLICY = f"default-src 'none'; style-src 'sha256-{STYLE_HASH}'"
PAGE = (
    '<!DOCTYPE html><html lang="{language}" dir="{direction}"><meta charset="utf-8"><title>chefbot</title>'
    '<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style>'
    "<h1>chefbot</h1><p>{reason}</p></html>"
)
RIGHT_TO_LEFT = ("ar",)


def refusal(reason: str, headers: Headers) -> Response:
    """Return the answer with the reason, status 403; it ends the connection."""
    common = {**SECURITY_HEADERS, "connection": "close", "vary": "accept, accept-language"}
    if "text/html" not in headers.get("accept", ""):
        return PlainTextResponse(reason, 403, common)
    language, text = _in_language(reason, headers.get("accept-language", ""))
    direction = "rtl" if language in RIGHT_TO_LEFT else "ltr"
    page = PAGE.format(
        language=language, direction=direction, style=STYLE, reason=html.escape(text, quote=False)
    )
    return Response(page, 403, {**common, "content-security-policy": POLICY}, "text/html")


@lru_cache(1)
def sentences() -> dict[str, dict[str, str]]:
    """Return the translations of the robot's sentences by language; read once, before the first request."""
    files = sorted(FOLDER.glob("languages/*.json"))
    return {path.stem: msgspec.json.decode(path.read_bytes())["robot"] for path in files}


def _in_language(reason: str, accepted: str) -> tuple[str, str]:
    """Return the first language that a browser accepts and the reason has, and the reason in it; else English."""
    for language in _languages(accepted):
        if language == "en":
            break
        if reason in sentences().get(language, {}):
            return language, sentences()[language][reason]
    return "en", reason


def _languages(accepted: str) -> Iterator[str]:
    """Yield the languages of an Accept-Language header in its order, which is that of browsers' preferences."""
    for part in accepted.split(","):
        yield part.split(";")[0].split("-")[0].strip().lower()

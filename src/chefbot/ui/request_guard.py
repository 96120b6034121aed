"""Access control of the web UI: same host, same origin, and on a network only with the token.

A page of another site must not reach the robot through the operator's browser: DNS rebinding shows in the
Host header, a cross-origin WebSocket in the Origin header (RFC 6455, section 10.2). Programs that are not
browsers send no Origin; they could forge one anyway.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from chefbot.ui.access.visitors import LOCAL, TokenKey, Visitor
from chefbot.ui.files import SECURITY_HEADERS

COOKIE = "chefbot"


class RequestGuard:
    """ASGI middleware that checks each request; `key` is None on loopback, else it checks the token that the
    first visit must contain. `names`: host names of this server beside its addresses.

    The application finds the visitor in the scope's `state`; the connection's `Peer` there, if any, learns that the
    request is valid.
    """

    def __init__(self, app: ASGIApp, names: Collection[str], key: TokenKey | None) -> None:
        self._app = app
        self._names = {"localhost", *(name.lower() for name in names)}
        self._key = key

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, or refuse it."""
        violation = self._find_violation(scope)
        # The first visit carries the token in the URL; later ones carry it in the cookie.
        url_token = self._url_token(scope)
        visitor = None if violation else self._visitor(scope, url_token)
        if visitor is None:
            await self._refuse(scope, receive, send, violation)
            return
        state = scope.setdefault("state", {})
        state["visitor"] = visitor
        if "peer" in state:
            state["peer"].recognize()
        if url_token:
            await _set_cookie(url_token, secure=scope.get("scheme") == "https")(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, violation: str | None) -> None:
        """Refuse a request and end its connection: a stranger gets one answer per connection."""
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        reason = violation or "Open the address with the token that chefbot printed at its start."
        headers = {**SECURITY_HEADERS, "connection": "close"}
        await PlainTextResponse(reason, 403, headers)(scope, receive, send)

    def _find_violation(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if not self._is_allowed_host(host):
            return "The Host header does not name the robot; use its IP address or localhost."
        origin = headers.get("origin")
        if scope["type"] == "websocket" and origin is not None and origin != f"{_scheme(scope)}://{host}":
            return "Requests from other sites are not allowed."
        return None

    def _is_allowed_host(self, header: str) -> bool:
        """Check the Host header. Rebinding needs a domain name, so any IP address is safe."""
        try:
            name = urlsplit(f"//{header}").hostname or ""
        except ValueError:
            return False
        return name in self._names or _is_address(name)

    def _url_token(self, scope: Scope) -> str:
        """Return the valid token in the address of a first visit; empty without one, or if none is needed."""
        if self._key is None or scope["type"] != "http" or scope["path"] != "/":
            return ""
        query = parse_qs(scope["query_string"].decode("latin-1"))
        token = query.get("token", [""])[0]
        return token if self._key.visitor(token) else ""

    def _visitor(self, scope: Scope, url_token: str) -> Visitor | None:
        if self._key is None:
            return LOCAL
        return self._key.visitor(url_token or _cookie(scope))


def _cookie(scope: Scope) -> str:
    """Return the token in the cookie, or an empty string."""
    try:
        cookie = SimpleCookie(Headers(scope=scope).get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if cookie is None else cookie.value


def _set_cookie(token: str, *, secure: bool) -> Response:
    """Redirect, with the token in a cookie that no script and no other site can read, so that it is not in the
    URL."""
    response = RedirectResponse("/", 303, SECURITY_HEADERS)
    response.set_cookie(COOKIE, token, httponly=True, samesite="strict", secure=secure)
    return response


def _scheme(scope: Scope) -> str:
    """Return the scheme of the page that opens a web socket."""
    return "https" if scope.get("scheme") == "wss" else "http"


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True

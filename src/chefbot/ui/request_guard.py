"""Access control of the web UI: same host, same origin, and on a network only with the token.

A page of another site must not reach the robot through the operator's browser: DNS rebinding shows in the
Host header, a cross-origin WebSocket in the Origin header (RFC 6455, section 10.2). Programs that are not
browsers send no Origin; they could forge one anyway.
"""

from __future__ import annotations

import hmac
import ipaddress
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from chefbot.ui.files import SECURITY_HEADERS

COOKIE = "chefbot"


class RequestGuard:
    """ASGI middleware that checks each request; `token` is None on loopback, else the secret that the first
    visit must contain."""

    def __init__(self, app: ASGIApp, host: str, token: str | None) -> None:
        self._app = app
        self._host = host
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, or refuse it."""
        violation = self._find_violation(scope)
        # The first visit carries the token in the URL; later ones carry it in the cookie.
        if violation is None and self._has_url_token(scope):
            await self._set_cookie()(scope, receive, send)
        elif violation is None and self._has_cookie(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            reason = violation or "Open the address with the token that chefbot printed at its start."
            await PlainTextResponse(reason, 403, SECURITY_HEADERS)(scope, receive, send)

    def _find_violation(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if not self._is_allowed_host(host):
            return "The Host header does not name the robot; use its IP address or localhost."
        origin = headers.get("origin")
        if scope["type"] == "websocket" and origin is not None and origin != f"http://{host}":
            return "Requests from other sites are not allowed."
        return None

    def _is_allowed_host(self, header: str) -> bool:
        """Check the Host header. Rebinding needs a domain name, so any IP address is safe."""
        try:
            name = urlsplit(f"//{header}").hostname or ""
        except ValueError:
            return False
        return name in ("localhost", self._host.lower()) or _is_address(name)

    def _has_url_token(self, scope: Scope) -> bool:
        if self._token is None or scope["type"] != "http" or scope["path"] != "/":
            return False
        query = parse_qs(scope["query_string"].decode("latin-1"))
        return _equal(query.get("token", [""])[0], self._token)

    def _has_cookie(self, scope: Scope) -> bool:
        if self._token is None:
            return True
        try:
            cookie = SimpleCookie(Headers(scope=scope).get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return cookie is not None and _equal(cookie.value, self._token)

    def _set_cookie(self) -> Response:
        """Redirect, with the token in a cookie that no script and no other site can read, so that it is not
        in the URL."""
        response = RedirectResponse("/", 303, SECURITY_HEADERS)
        response.set_cookie(COOKIE, self._token or "", httponly=True, samesite="strict")
        return response


def _equal(received: str, token: str) -> bool:
    return hmac.compare_digest(received.encode(), token.encode())


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True

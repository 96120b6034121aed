"""Access control of the web UI: same host, same origin, and on a network only with the token.

A page of another site must not reach the robot through the operator's browser: DNS rebinding shows in the
Host header, a cross-origin WebSocket or POST in the Origin header (RFC 6455, section 10.2; RFC 6454, section 7).
Programs that are not browsers send no Origin; they could forge one anyway.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from chefbot.ui.access.identification import Identification
from chefbot.ui.access.refusal_page import refusal, sentences
from chefbot.ui.access.visitors import LOCAL, Visitor
from chefbot.ui.files import SECURITY_HEADERS

COOKIE = "chefbot"
"""Name of the cookie with the token; that of a browser ends in the robot's name, since cookies are of a host with all
its ports, and robots may share a host."""
COOKIE_DAYS = 400
"""Time for which a browser keeps an invited person's token; browsers allow no longer one (RFC 6265bis, 5.5)."""
WRONG_HOST = "The Host header does not name the robot; use its IP address or localhost, or add it to names."
NO_TOKEN = (
    "Open the link that you were given, or the address with the token that chefbot printed at its start."
)
INVALID_TOKEN = "This link is not valid, or no longer valid; ask for a new one."


class RequestGuard:
    """ASGI middleware that checks each request; `identification` is None on loopback, else it checks the token that
    the first visit must contain, and that the browser keeps as `cookie`.

    `names`: host names of this server beside its addresses; `proxy_names`: those at which a reverse proxy serves it
    by https. The application finds visitor and token in the scope's `state`; the connection's `Peer` there, if any,
    learns that the request is valid.
    """

    def __init__(
        self,
        app: ASGIApp,
        names: Collection[str],
        proxy_names: Collection[str] = (),
        identification: Identification | None = None,
        cookie: str = COOKIE,
    ) -> None:
        sentences()  # read here, because at a request it would delay an emergency stop
        self._app = app
        self._proxy_names = {name.lower() for name in proxy_names}
        self._names = {"localhost", *(name.lower() for name in names), *self._proxy_names}
        self._identification = identification
        self._cookie = cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, or refuse it."""
        violation = self._find_violation(scope)
        # The first visit carries the token in the URL; later ones carry it in the cookie.
        url_token = self._url_token(scope)
        visitor, token = (None, "") if violation else self._visitor(scope, url_token)
        if visitor is None:
            await self._refuse(scope, receive, send, violation or (INVALID_TOKEN if token else NO_TOKEN))
            return
        state = scope.setdefault("state", {})
        state["visitor"], state["token"] = visitor, token
        if "peer" in state:
            state["peer"].recognize()
        if token and token == url_token:
            await self._set_cookie(url_token, scope)(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, reason: str) -> None:
        """Refuse a request and end its connection: a stranger gets one answer per connection."""
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        await refusal(reason, Headers(scope=scope))(scope, receive, send)

    def _find_violation(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if not self._is_allowed_host(host):
            return WRONG_HOST
        origin = headers.get("origin")
        changes = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if changes and origin is not None and origin not in self._origins(scope, host):
            return "Requests from other sites are not allowed."
        return None

    def _origins(self, scope: Scope, host: str) -> list[str]:
        """Return the origins of the page itself, which may open a web socket and press STOP."""
        scheme = "https" if scope.get("scheme") in ("wss", "https") else "http"
        return [f"{scheme}://{host}", *([f"https://{host}"] if self._by_proxy(host) else [])]

    def _by_proxy(self, host: str) -> bool:
        """Return whether a reverse proxy passed the request on, by http whatever the browser used."""
        return _host_name(host) in self._proxy_names

    def _is_allowed_host(self, header: str) -> bool:
        """Check the Host header. Rebinding needs a domain name, so any IP address is safe."""
        name = _host_name(header)
        return name in self._names or _is_address(name)

    def _url_token(self, scope: Scope) -> str:
        """Return the token in the address of a first visit; empty without one, or if none is needed."""
        if self._identification is None or scope["type"] != "http" or scope["path"] != "/":
            return ""
        query = parse_qs(scope["query_string"].decode("latin-1"))
        return query.get("token", [""])[0]

    def _visitor(self, scope: Scope, url_token: str) -> tuple[Visitor | None, str]:
        """Return the visitor of the first token that is valid, with this token; else None and some token or none."""
        if self._identification is None:
            return LOCAL, ""
        tokens = [*([url_token] if url_token else []), *self._cookie_tokens(scope)]
        for token in tokens:
            if visitor := self._identification.visitor(token):
                return visitor, token
        return None, "".join(tokens[:1])

    def _cookie_tokens(self, scope: Scope) -> list[str]:
        """Return the tokens in the cookies of this robot, first that of a browser."""
        try:
            cookies = SimpleCookie(Headers(scope=scope).get("cookie", ""))
        except CookieError:
            return []
        return [cookies[name].value for name in dict.fromkeys((self._cookie, COOKIE)) if name in cookies]

    def _set_cookie(self, token: str, scope: Scope) -> Response:
        """Redirect, with the token in a cookie that no script and no other site can read, so that it is not in the
        URL."""
        response = RedirectResponse("/", 303, SECURITY_HEADERS)
        secure = scope.get("scheme") == "https" or self._by_proxy(Headers(scope=scope).get("host", ""))
        lasting = self._identification is not None and self._identification.invited(token) is not None
        max_age = COOKIE_DAYS * 86400 if lasting else None
        response.set_cookie(
            self._cookie, token, max_age=max_age, httponly=True, samesite="strict", secure=secure
        )
        return response


def _host_name(header: str) -> str:
    """Return the host name in a Host header, without the port; empty if it is malformed."""
    try:
        return urlsplit(f"//{header}").hostname or ""
    except ValueError:
        return ""


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True

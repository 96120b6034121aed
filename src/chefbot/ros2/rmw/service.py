"""Service servers and clients compatible with rmw_zenoh: a queryable and a querier."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Generic, TypeVar

import zenoh
from zenoh import handlers

from chefbot.errors import ChefbotError
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service
from chefbot.ros2.rmw.attachment import Attachment, parse
from chefbot.ros2.rmw.errors import ErrorCounter, RmwError
from chefbot.ros2.rmw.session import RmwContext

Q = TypeVar("Q", bound=Message)
S = TypeVar("S", bound=Message)
TIMEOUT = 600.0
"""Maximum time a client waits, s (rmw_zenoh's `queries_default_timeout`)."""
NO_TIMEOUT = 10 * 365 * 86400.0
"""Timeout for results of actions, s: ten years, effectively none."""


class NoResponseError(ChefbotError):
    """Raised when a service has no server, or its server disappeared or refused the request.

    The message names the service.
    """


class ServiceCall(Generic[Q, S]):
    """One service request; call `respond` once, at once or later, from any thread.

    If it is dropped without an answer, the client is notified.
    """

    def __init__(self, query: zenoh.Query, key: str, request: Q, attachment: Attachment) -> None:
        self.request = request
        self._key = key
        self._query: zenoh.Query | None = query
        self._attachment = attachment

    def respond(self, response: S) -> None:
        """Send the response, with the sequence number and GID of the request.

        Raises CdrError when a value does not fit its field.
        """
        query, self._query = self._query, None
        if query is None:
            return
        attachment = self._attachment._replace(stamp_ns=time.time_ns())
        query.reply(self._key, response.to_cdr(), attachment=attachment.pack())
        query.drop()


class Server(Generic[Q, S]):
    """A service server, created by `RmwNode.server`.

    `handler(call)` runs in a Zenoh thread and must return at once.
    """

    def __init__(
        self,
        wire: RmwContext,
        key: str,
        service: Service[Q, S],
        handler: Callable[[ServiceCall[Q, S]], None],
        *,
        name: str,
        remote_only: bool = False,
    ) -> None:
        self._key = key
        self._service = service
        self._handler = handler
        self._name = name
        self._refused: ErrorCounter = wire.rejected
        origin = zenoh.Locality.REMOTE if remote_only else zenoh.Locality.ANY
        callback = handlers.Callback(
            self._on_query, indirect=False
        )  # an indirect callback would cost a thread
        self._zenoh = wire.session.declare_queryable(key, callback, complete=True, allowed_origin=origin)

    def close(self) -> None:
        """Undeclare the service server from the Zenoh session."""
        self._zenoh.undeclare()

    def _on_query(self, query: zenoh.Query) -> None:
        try:
            attachment = parse(None if query.attachment is None else query.attachment.to_bytes())
            payload = b"" if query.payload is None else query.payload.to_bytes()
            call = ServiceCall[Q, S](query, self._key, self._service.request.from_cdr(payload), attachment)
        except (RmwError, CdrError) as error:
            self._refused.add(f"{self._name}: {error}")
            query.reply_err(str(error).encode())
            return
        self._handler(call)


class Client(Generic[Q, S]):
    """A service client, created by `RmwNode.client`. Thread-safe."""

    def __init__(
        self,
        wire: RmwContext,
        key: str,
        service: Service[Q, S],
        gid: bytes,
        *,
        name: str,
        timeout: float = TIMEOUT,
    ) -> None:
        self.gid = gid
        self._service = service
        self._name = name
        self._refused: ErrorCounter = wire.rejected
        self._sequence = 0
        self._lock = threading.RLock()  # a server in this process may respond within the call
        self._zenoh = wire.session.declare_querier(
            key,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
        )

    @property
    def server_is_ready(self) -> bool:
        """Return whether a matching service server is reachable."""
        with self._lock:
            return bool(getattr(self._zenoh.matching_status, "matching", False))

    def call(self, request: Q, timeout: float = 5.0) -> S:
        """Call the service and return the response.

        Raises NoResponseError if there is none, TimeoutError after `timeout` seconds.
        """
        return self.call_async(request).result(timeout)

    def call_async(self, request: Q) -> Future[S]:
        """Start a call and return a future of the response.

        Its callbacks run in a Zenoh thread. It may fail with NoResponseError.
        """
        future: Future[S] = Future()

        def on_reply(reply: zenoh.Reply) -> None:
            self._on_reply(reply, future)

        def on_done() -> None:
            if not future.done():
                _fail(future, NoResponseError(f"service {self._name}: no response"))

        payload = request.to_cdr()
        with self._lock:
            self._sequence += 1
            attachment = Attachment(self._sequence, time.time_ns(), self.gid)
            self._zenoh.get(
                handlers.Callback(on_reply, on_done), payload=payload, attachment=attachment.pack()
            )
        return future

    def close(self) -> None:
        """Undeclare the service client from the Zenoh session, after a thread that is calling."""
        with self._lock:  # Zenoh raises RuntimeError if a call is in progress
            self._zenoh.undeclare()

    def _on_reply(self, reply: zenoh.Reply, future: Future[S]) -> None:
        if future.done():
            return  # with two servers of one name the first response is used
        if reply.ok is None:
            reason = "" if reply.err is None else reply.err.payload.to_bytes()[:200].decode(errors="replace")
            _fail(future, NoResponseError(f"service {self._name}: the server refused: {reason}"))
            return
        try:
            parse(None if reply.ok.attachment is None else reply.ok.attachment.to_bytes())
            response = self._service.response.from_cdr(reply.ok.payload.to_bytes())
        except (RmwError, CdrError) as error:
            self._refused.add(f"{self._name}: {error}")
            _fail(future, NoResponseError(f"service {self._name}: the response was rejected: {error}"))
        else:
            if future.set_running_or_notify_cancel():
                future.set_result(response)


def _fail(future: Future[Any], error: Exception) -> None:
    if future.set_running_or_notify_cancel():
        future.set_exception(error)

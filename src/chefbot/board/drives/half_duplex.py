"""Requests and answers on a line on which only one of both sides sends at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from chefbot.board.command_gate import NEVER_NS

ANSWER_TIMEOUT_NS = 40_000_000
"""Time after which an answer is lost, ns; a drive has forgotten an incomplete request by then."""


class LineRequest(NamedTuple):
    """A request and its answer.

    length: bytes of the whole answer, of which the first have come; 0 if more are needed to know it. valid: whether
    the checksum of a whole answer is right.
    """

    name: str
    data: bytes
    length: Callable[[bytes], int]
    valid: Callable[[bytes], bool]


class Answer(NamedTuple):
    """A valid answer to a request, and the time at which it was given, as far as known, ns."""

    name: str
    data: bytes
    stamp_ns: int


class HalfDuplexLine:
    """One request at a time: the next one is sent after the answer, or after it has not come in time."""

    def __init__(self) -> None:
        self.lost = self.damaged = 0
        """Number of answers that did not come, and of those with a wrong checksum."""
        self.clear()

    def clear(self) -> None:
        """Forget the request that is pending."""
        self._pending: LineRequest | None = None
        self._buffer, self._sent_ns = b"", NEVER_NS

    def is_free(self, now_ns: int) -> bool:
        """Return whether a request may be sent."""
        if self._pending is not None and now_ns - self._sent_ns >= ANSWER_TIMEOUT_NS:
            self.lost += 1
            self._pending = None
        return self._pending is None

    def send(self, request: LineRequest, now_ns: int) -> bytes:
        """Return the bytes of a request; what was received before it is not its answer."""
        self._pending, self._buffer, self._sent_ns = request, b"", now_ns
        return request.data

    def receive(self, data: bytes, now_ns: int) -> Answer | None:
        """Return the answer that received bytes complete, None as long as it is incomplete or if it is damaged."""
        request = self._pending
        if request is None:
            return None
        self._buffer += data
        length = request.length(self._buffer)
        if length == 0 or len(self._buffer) < length:
            return None
        answer, self._pending = self._buffer[:length], None
        if not request.valid(answer):
            self.damaged += 1
            return None
        # request and answer take about the same time on their way
        return Answer(request.name, answer, (self._sent_ns + now_ns) // 2)

    @property
    def unanswered(self) -> bytes:
        """Bytes of an incomplete answer to the pending request."""
        return self._buffer

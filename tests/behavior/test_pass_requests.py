"""Requests to pass: after some time of waiting, then periodically, with short pauses counted as waiting."""

from __future__ import annotations

import pytest

from chefbot.behavior.pass_requests import PAUSE_NS, PassRequests
from chefbot.behavior.recovery import WaitingParams

PARAMS = WaitingParams(request_after=3.0, request_period=15.0)
SECOND = 1_000_000_000


def wait(requests: PassRequests, begin: int, end: int, params: WaitingParams = PARAMS) -> list[int]:
    """Wait from `begin` to `end`, s, with a check each second; return the times of requests."""
    requests.begin(begin * SECOND)
    made = []
    for now_ns in range(begin * SECOND, (end + 1) * SECOND, SECOND):
        requests.wait(now_ns)
        if requests.are_due(now_ns, params) and requests.take(now_ns, params):
            made.append(now_ns // SECOND)
    return made


def test_requests_begin_after_a_delay_and_are_periodic() -> None:
    assert wait(PassRequests(), 0, 40) == [3, 18, 33]


def test_a_short_wait_makes_no_request() -> None:
    assert wait(PassRequests(), 0, 2) == []


def test_an_empty_request_is_never_due() -> None:
    assert wait(PassRequests(), 0, 40, WaitingParams(request="")) == []


@pytest.mark.parametrize(("pause", "waited"), [(PAUSE_NS, 12.0), (PAUSE_NS + SECOND, 0.0)])
def test_waits_with_a_short_pause_between_count_as_one(pause: int, waited: float) -> None:
    requests = PassRequests()
    wait(requests, 0, 2)
    now_ns = 2 * SECOND + pause
    requests.begin(now_ns)
    assert requests.waited(now_ns) == pytest.approx(waited)


def test_the_period_of_requests_outlasts_a_pause() -> None:
    requests = PassRequests()
    assert wait(requests, 0, 3) == [3]
    assert wait(requests, 9, 20) == [18]

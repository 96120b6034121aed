"""The server's memory of the last ping of each page."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.ui.received_pings import MAX_NAME, MAX_PAGES, ReceivedPings


@given(st.lists(st.tuples(st.sampled_from(["a", "b", "c"]), st.integers(1, 1000))))
def test_the_last_ping_of_each_page_is_remembered(pings: list[tuple[str, int]]) -> None:
    received = ReceivedPings()
    for page, number in pings:
        received.note(page, number)
    assert all(received.last(page) == dict(pings).get(page, 0) for page in "abc")


def test_the_page_that_was_silent_for_longest_is_forgotten() -> None:
    received = ReceivedPings()
    for number in range(MAX_PAGES):
        received.note(f"page {number}", 7)
    received.note("page 0", 8)
    received.note("another", 9)
    assert (received.last("page 0"), received.last("page 1"), received.last("another")) == (8, 0, 9)


def test_a_page_without_a_usable_name_is_not_remembered() -> None:
    received = ReceivedPings()
    for name in ("", "x" * (MAX_NAME + 1)):
        received.note(name, 3)
        assert received.last(name) == 0


def test_each_server_has_a_name_of_its_own() -> None:
    assert ReceivedPings().server != ReceivedPings().server

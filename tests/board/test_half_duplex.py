"""One request at a time: answers in pieces, late ones, damaged ones."""

from __future__ import annotations

from chefbot.board.drives.half_duplex import ANSWER_TIMEOUT_NS, HalfDuplexLine, LineRequest

REQUEST = LineRequest("sum", b"?", lambda _: 3, lambda answer: answer[0] + answer[1] == answer[2])


def sent() -> HalfDuplexLine:
    line = HalfDuplexLine()
    assert line.is_free(0) and line.send(REQUEST, 0) == b"?" and not line.is_free(1)
    return line


def test_an_answer_in_pieces_is_stamped_half_way() -> None:
    line = sent()
    assert line.receive(b"\x01\x02", 1_000_000) is None
    answer = line.receive(b"\x03", 2_000_000)
    assert answer is not None and (answer.name, answer.stamp_ns) == ("sum", 1_000_000)
    assert (
        line.is_free(2_000_000) and line.receive(b"\x01\x02\x03", 3_000_000) is None
    )  # nothing was requested


def test_a_damaged_answer_frees_the_line() -> None:
    line = sent()
    assert line.receive(b"\x01\x02\x04", 1) is None and line.damaged == 1 and line.is_free(1)


def test_a_lost_answer_frees_the_line_after_its_time() -> None:
    line = sent()
    assert not line.is_free(ANSWER_TIMEOUT_NS - 1)
    assert line.is_free(ANSWER_TIMEOUT_NS) and line.lost == 1
    line.send(REQUEST, ANSWER_TIMEOUT_NS)
    assert line.receive(b"\x01\x02\x03", ANSWER_TIMEOUT_NS + 1) is not None

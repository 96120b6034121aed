"""Tests of what a browser is sent next."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.waiting import PATIENCE
from websockets.sync.client import connect

from chefbot.ui.display.views import ProgressView, StatusView
from chefbot.ui.outbox import MAX_UNDER_WAY, Outbox
from chefbot.ui.protocol import PieceAssembler, split_into_pieces

FRAMES = {
    "stop": "s",
    "status": "t",
    "robot": "r",
    "scan": b"x" * 1_500,
    "camera": b"c" * 12_000,
    "map": b"m" * 40_000,
}
STEPS = st.lists(st.sampled_from([*FRAMES, "take", "received"]), max_size=200)


NAMES = {frame: name for name, frame in FRAMES.items()}


class Receiver:
    """Takes from an outbox what it gives out, and counts the pieces."""

    def __init__(self, outbox: Outbox) -> None:
        self.outbox, self.assembler = outbox, PieceAssembler(100_000)
        self.sizes: list[int] = []

    def take(self) -> str | None:
        """Return the layer that is complete now; "" after a piece of one, None if nothing may be sent."""
        message = self.outbox.take(FRAMES)
        if message is None or isinstance(message, str):
            return None if message is None else NAMES[message]
        self.sizes.append(len(message))
        whole = self.assembler.add(message)
        return "" if whole is None else NAMES[whole]

    def all(self) -> list[str]:
        """Return the layers that may be sent now."""
        return [layer for layer in iter(self.take, None) if layer]


def taken(outbox: Outbox) -> list[str]:
    """Return the layers of all that the outbox gives out now."""
    return Receiver(outbox).all()


def test_only_layers_that_are_shown_are_sent() -> None:
    outbox = Outbox()
    outbox.show(["robot"], ())
    outbox.mark_changed(FRAMES)
    assert taken(outbox) == ["stop", "status", "robot"]
    outbox.show(["robot", "map"], FRAMES)
    assert taken(outbox) == ["map"]
    outbox.show(["map"], FRAMES)
    outbox.mark_changed(["robot", "map"])
    assert taken(outbox) == ["map"]


def test_the_emergency_stop_comes_first_and_always_remains() -> None:
    outbox = Outbox()
    outbox.mark_changed(["map", "robot", "stop"])
    assert taken(outbox) == ["stop", "robot", "map"]
    outbox.mark_changed(["map", "status", "stop"])
    outbox.show_only_stop()
    outbox.show(["map"], FRAMES)
    assert taken(outbox) == ["stop", "status"]


def test_a_program_that_does_not_count_gets_everything() -> None:
    outbox = Outbox()
    outbox.mark_changed(["map", "camera", "scan"])
    assert taken(outbox) == ["map", "camera", "scan"]


@given(STEPS)
def test_little_is_under_way_and_everything_arrives(steps: list[str]) -> None:
    outbox = Outbox()
    receiver, received, missing = Receiver(outbox), 0, set[str]()
    outbox.note_received(0)

    def take() -> bool:
        layer = receiver.take()
        assert sum(receiver.sizes[received:]) <= MAX_UNDER_WAY
        missing.discard(layer or "")
        return layer is not None

    for step in steps:
        if step == "take":
            take()
        elif step == "received":
            received = min(received + 1, len(receiver.sizes))
            outbox.note_received(received)
        else:
            outbox.mark_changed([step])
            missing.add(step)
    for _ in range(100):
        while take():
            pass
        received = len(receiver.sizes)
        outbox.note_received(received)
    assert not missing


def test_counting_more_than_was_sent_does_no_harm() -> None:
    outbox = Outbox()
    assert not outbox.note_received(10**9)
    outbox.mark_changed(["scan", "camera"])
    receiver = Receiver(outbox)
    assert receiver.all() == ["scan"]
    assert outbox.note_received(10**9)
    assert receiver.all() == ["camera"]


def test_small_layers_pass_between_the_pieces_of_a_large_one() -> None:
    outbox = Outbox()
    receiver = Receiver(outbox)
    outbox.mark_changed(["map"])
    assert receiver.take() == ""
    outbox.mark_changed(["robot", "stop"])
    assert [receiver.take(), receiver.take(), receiver.take()] == ["stop", "robot", ""]
    assert receiver.all() == ["map"]


@given(st.binary(min_size=1, max_size=20_000))
def test_pieces_make_the_whole(frame: bytes) -> None:
    assembler, pieces = PieceAssembler(20_000), split_into_pieces(frame)
    assert [assembler.add(piece) for piece in pieces] == [None] * (len(pieces) - 1) + [frame]


def test_pieces_of_a_stranger_are_refused() -> None:
    for pieces in ([b""], [b"\x02abc"], [b"\x01" + bytes(60), b"\x00" + bytes(60)]):
        assembler = PieceAssembler(100)
        with pytest.raises(ValueError, match="not a piece"):
            for piece in pieces:
                assembler.add(piece)


def test_a_browser_is_sent_what_it_shows(page: Any) -> None:
    page.server.set_layer("places", {"table_1": (2, 2, 0)})
    page.server.set_layer("progress", ProgressView(text="Mapping", done=1, total=2))
    with connect(f"{page.live}?layers=places", open_timeout=PATIENCE) as browser:
        assert json.loads(browser.recv(PATIENCE))["layer"] == "places"
        browser.send('{"do":"show","layers":["places","progress"]}')
        assert json.loads(browser.recv(PATIENCE))["layer"] == "progress"
        browser.send('{"do":"show","layers":["placse"]}')
        assert (
            json.loads(browser.recv(PATIENCE))["refused"]
            == "There is no layer 'placse' (did you mean 'places'?)"
        )
        page.server.set_layer("places", {})
        page.server.set_layer("status", StatusView(phase="Waiting."))
        assert json.loads(browser.recv(PATIENCE))["layer"] == "status"


def test_pictures_wait_for_a_browser_that_counts(page: Any) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (400, 400, 3)).astype(np.uint8)
    with page.browser() as browser:
        browser.send('{"do":"received","n":0}')
        page.server.set_layer("camera", noise)
        pieces = [browser.recv(PATIENCE) for _ in range(MAX_UNDER_WAY // 4097)]
        page.server.set_layer("places", {})
        assert "places" in browser.recv(PATIENCE)  # a small layer passes the picture that waits
        assembler = PieceAssembler(10**6)
        while assembler.add(pieces[-1]) is None:
            browser.send(f'{{"do":"received","n":{len(pieces)}}}')
            pieces.append(browser.recv(PATIENCE))
        assert sum(map(len, pieces)) > 40_000

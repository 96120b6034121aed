"""What is sent to a browser next: changed layers that it shows, with little bulk data under way."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping

from chefbot.ui.protocol import Frame, split_into_pieces

STOP_LAYERS = ("stop", "status")
"""Layers that every browser gets, also one that may only stop the robot."""
MAX_UNDER_WAY = 12_000
"""Bulk data that may be under way to a browser, bytes: 0.6 s of 20 kB/s; with 0.4 s of delay it gives 30 kB/s."""


class Outbox:
    """The names of the layers that a browser lacks; it holds one frame at most, so its memory is bounded.

    Without a limit the kernel's buffers would take seconds of pictures for a slow link, all of them old when they
    arrive. The limit holds from the first `received` on: simple programs do not count.
    """

    def __init__(self, hidden: frozenset[str] = frozenset()) -> None:
        """hidden: layers that this browser never gets."""
        self._hidden = hidden
        self._shown: frozenset[str] | None = None
        self._only_stop = False
        self._changed: dict[str, None] = {}
        self._pieces: deque[bytes] = deque()
        self._under_way: deque[int] = deque()
        self._pieces_sent = 0
        self._counts = False

    def mark_changed(self, layers: Iterable[str]) -> None:
        """Note layers whose frames have changed."""
        self._changed.update((layer, None) for layer in layers if self._wanted(layer))

    def show(self, layers: Collection[str], known: Iterable[str]) -> None:
        """Send only these layers from now on, and at once those of them in `known` that were not sent before."""
        before, self._shown = self._shown, frozenset(layers)
        self._changed = {layer: None for layer in self._changed if self._wanted(layer)}
        if before is not None:
            self.mark_changed(layer for layer in known if layer in self._shown - before)

    def show_only_stop(self) -> None:
        """Send only what is needed to stop the robot."""
        self._only_stop = True
        self._changed = {layer: None for layer in self._changed if self._wanted(layer)}

    def note_received(self, count: int) -> bool:
        """Note how many pieces the browser has received, and return whether these are more than before."""
        self._counts = True
        before, missing = len(self._under_way), max(0, self._pieces_sent - count)
        while len(self._under_way) > missing:
            self._under_way.popleft()
        return len(self._under_way) < before

    def take(self, frames: Mapping[str, Frame]) -> Frame | None:
        """Remove what is sent next and return it: the emergency stop, other small layers, a piece of a bulk layer.

        None if nothing has changed, or if too much bulk data is under way for the next piece.
        """
        for layer in ("stop", *self._changed) if "stop" in self._changed else self._changed:
            frame = frames[layer]
            if isinstance(frame, str):
                del self._changed[layer]
                return frame
        return self._take_piece(frames)

    def _take_piece(self, frames: Mapping[str, Frame]) -> bytes | None:
        if not self._pieces and self._changed:
            layer = next(iter(self._changed))
            del self._changed[layer]
            frame = frames[layer]
            assert isinstance(frame, bytes), "small layers are taken before"
            self._pieces.extend(split_into_pieces(frame))
        if not self._pieces or not self._has_room(len(self._pieces[0])):
            return None
        self._pieces_sent += 1
        self._under_way.append(len(self._pieces[0]))
        return self._pieces.popleft()

    def _has_room(self, size: int) -> bool:
        return not self._counts or sum(self._under_way) + size <= MAX_UNDER_WAY

    def _wanted(self, layer: str) -> bool:
        if layer in STOP_LAYERS:
            return True
        shown = self._shown is None or layer in self._shown
        return shown and not self._only_stop and layer not in self._hidden

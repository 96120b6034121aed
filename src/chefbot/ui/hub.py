"""The latest value of every layer: written by any thread, encoded once for all clients, never queued."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from chefbot.errors import nearest
from chefbot.ui import wire
from chefbot.ui.layers import LAYERS

ENCODING_SHARE = 0.1
"""A layer that is slow to encode comes less often, so that its encoding takes at most this part of a core."""


class Hub:
    """Holds per layer one copied value and one encoded frame; what nobody fetched in time is overwritten."""

    def __init__(self) -> None:
        self.frames: dict[str, wire.Frame] = {}
        self._lock = threading.Lock()
        self._fresh: dict[str, Any] = {}
        self._next: dict[str, float] = {}

    def show(self, layer: str, payload: Any) -> None:
        """Keep a copy of the payload as the layer's latest value; None clears the layer. Any thread.

        Raises ValueError or TypeError for an unknown layer or a payload of another shape (see `layers`).
        """
        if layer not in LAYERS:
            raise ValueError(f"the page has no layer {layer!r}{nearest(layer, LAYERS)}")
        value = None if payload is None else LAYERS[layer].take(payload)
        with self._lock:
            self._fresh[layer] = value

    def encode_due(self, clock: Callable[[], float]) -> list[str]:
        """Encode the layers that changed and whose turn it is; their names. One thread at a time.

        Without a viewer nobody calls this, and nothing is encoded.
        """
        due = self._take_due(clock())
        for layer, value in due.items():
            start = clock()
            self.frames[layer] = _encode(layer, value)
            cost = clock() - start
            self._next[layer] = start + max(LAYERS[layer].period, cost / ENCODING_SHARE)
        return list(due)

    def _take_due(self, now: float) -> dict[str, Any]:
        with self._lock:
            due = [layer for layer in self._fresh if now >= self._next.get(layer, now)]
            return {layer: self._fresh.pop(layer) for layer in due}


def _encode(layer: str, value: Any) -> wire.Frame:
    return wire.text(layer, None) if value is None else LAYERS[layer].encode(layer, value)

"""The latest value of every layer: set from any thread, encoded once for all clients, never queued."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from chefbot.errors import name_hint
from chefbot.ui import protocol
from chefbot.ui.layers import LAYERS

MAX_ENCODING_SHARE = 0.1
"""Maximum share of a core for encoding one layer: a layer that is slow to encode is sent less often."""


class LayerStore:
    """Holds one copied value and one encoded frame per layer; values that were not encoded in time are
    overwritten."""

    def __init__(self) -> None:
        self.frames: dict[str, protocol.Frame] = {}
        self._lock = threading.Lock()
        self._changed: dict[str, Any] = {}
        self._due_time: dict[str, float] = {}

    def set_layer(self, layer: str, payload: Any) -> None:
        """Keep a copy of the payload as the layer's latest value; None clears the layer. Thread-safe.

        Raises ValueError or TypeError for an unknown layer or a payload of the wrong type or shape (see
        `layers`).
        """
        if layer not in LAYERS:
            raise ValueError(f"the web UI has no layer {layer!r}{name_hint(layer, LAYERS)}")
        value = None if payload is None else LAYERS[layer].validate(payload)
        with self._lock:
            self._changed[layer] = value

    def has_value(self, layer: str) -> bool:
        """Whether the layer has a value, encoded or not. Thread-safe."""
        with self._lock:
            if layer in self._changed:
                return self._changed[layer] is not None
            return layer in self.frames and self.frames[layer] != protocol.text(layer, None)

    def encode_due(self, clock: Callable[[], float]) -> list[str]:
        """Encode the layers that are due and return the names of those whose frame is another than before.

        Call it from one thread at a time. It is only called while browsers are connected, so that nothing is encoded
        otherwise.
        """
        changed = []
        for layer, value in self._take_due(clock()).items():
            start = clock()
            frame = _encode(layer, value)
            cost = clock() - start
            # Next due time: the layer's period, or longer if it is expensive to encode.
            self._due_time[layer] = start + max(LAYERS[layer].period, cost / MAX_ENCODING_SHARE)
            if frame != self.frames.get(layer):
                self.frames[layer] = frame
                changed.append(layer)
        return changed

    def _take_due(self, now: float) -> dict[str, Any]:
        with self._lock:
            due = [layer for layer in self._changed if now >= self._due_time.get(layer, now)]
            return {layer: self._changed.pop(layer) for layer in due}


def _encode(layer: str, value: Any) -> protocol.Frame:
    return protocol.text(layer, None) if value is None else LAYERS[layer].encode(layer, value)

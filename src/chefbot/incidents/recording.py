"""A recording of any length: the minute before, and what is published until it is ended."""

from __future__ import annotations

import queue
import shutil
from collections.abc import Iterator
from pathlib import Path

from chefbot.incidents.buffer import Thinning
from chefbot.runtime.loop import Publication

MAX_LENGTH_NS = 3600 * 10**9
"""Length at which a recording ends by itself, ns: it takes about 1.2 GB then."""
MIN_FREE = 500_000_000
"""Free disk space at which a recording ends by itself, bytes."""
CHECK_INTERVAL = 1000
"""Number of messages after which the disk is checked."""
TOO_LONG = "The recording ended: it is an hour long"
DISK_FULL = "The recording ended: the disk has less than 500 MB left"


class Recording:
    """Observes a loop until `end`; its content is iterated once, in another thread, and ends when the recording does.

    `begin`: what was published before, in the order of publication. `folder`: whose disk must not become full.
    """

    def __init__(self, begin: list[Publication], folder: Path) -> None:
        self._begin, self._folder = begin, folder
        self._thinning = Thinning()
        self._queue: queue.SimpleQueue[Publication | None] = queue.SimpleQueue()
        self._ended = False
        self.reason = ""
        """Why it ended by itself, as a sentence without a full stop; empty if it was ended."""

    def __call__(self, publication: Publication) -> None:
        """Take a publication of the loop, in its thread."""
        if not self._ended and self._thinning.keeps(publication):
            self._queue.put(publication)

    def end(self) -> None:
        """End the recording; thread-safe, and a second time has no effect."""
        self._ended = True
        self._queue.put(None)

    def __iter__(self) -> Iterator[Publication]:
        yield from self._begin
        begin_ns: int | None = None
        count = 0
        while (publication := self._queue.get()) is not None:
            begin_ns = publication.time_ns if begin_ns is None else begin_ns
            yield publication
            count += 1
            self.reason = self._limit(publication.time_ns - begin_ns, count)
            if self.reason:
                self._ended = True
                return

    def _limit(self, length_ns: int, count: int) -> str:
        """Return why the recording has to end, an empty text if it has not."""
        if length_ns > MAX_LENGTH_NS:
            return TOO_LONG
        if count % CHECK_INTERVAL == 0 and shutil.disk_usage(self._folder).free < MIN_FREE:
            return DISK_FULL
        return ""

"""The input of a worker process: its lines, and its end."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.launcher import worker
from chefbot.launcher.worker import LaunchInput


def input_of(chunks: list[bytes], stop: Any = None) -> tuple[list[bytes], list[int]]:
    """The lines that are read from the chunks, and the exit codes; the reading thread runs here."""
    rest, codes = iter([*chunks, b""]), list[int]()
    reader = LaunchInput.__new__(LaunchInput)
    reader.stop = stop
    reader._lines = worker.queue.SimpleQueue()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "_read_stdin", lambda: next(rest))
        patch.setattr(worker, "os", SimpleNamespace(_exit=codes.append))
        patch.setattr(worker, "time", SimpleNamespace(sleep=lambda _: None))
        reader._read()
    return [reader.line() for _ in range(reader._lines.qsize())], codes


@given(st.binary(max_size=200), st.lists(st.integers(0, 200), max_size=6))
def test_lines_do_not_depend_on_the_chunks(data: bytes, cuts: list[int]) -> None:
    places = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    chunks = [data[a:b] for a, b in pairwise(places) if a < b]
    lines, _ = input_of(chunks)
    assert lines == data.split(b"\n")[:-1]


def test_the_process_exits_with_its_input() -> None:
    stops: list[str] = []
    assert input_of([b"a\n"])[1] == [0], "nothing was running"
    assert input_of([b"a\n"], lambda: stops.append("stop"))[1] == [1], "the loop did not end in time"
    assert stops == ["stop"]


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    reading, writing = os.pipe()
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(fileno=lambda: reading))
    yield writing
    os.close(reading)


def test_the_input_is_read_unbuffered(pipe: int) -> None:
    found: list[bytes] = []
    reader = threading.Thread(target=lambda: found.append(worker._read_stdin()))
    reader.start()
    os.write(pipe, b"one line\nhalf")
    reader.join()
    os.close(pipe)
    assert found == [b"one line\nhalf"] and worker._read_stdin() == b""


def test_a_launch_that_died_with_unread_data_is_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def reset(*_: object) -> bytes:
        raise ConnectionResetError

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(fileno=lambda: 0))
    monkeypatch.setattr(worker, "os", SimpleNamespace(read=reset))
    assert worker._read_stdin() == b""

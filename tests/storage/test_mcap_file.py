"""Tests that recordings are written byte for byte as the library `mcap` writes them."""

import io
import random

from mcap.reader import make_reader
from mcap.writer import Writer

from chefbot.storage.mcap_file import McapFile


def written_by_the_library(messages: list[tuple[int, int, bytes]]) -> bytes:
    """Return the file that the library writes of messages (channel, time, data) on three channels."""
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros2", library="test")
    writer.add_metadata("about", {"robot": "chefbot"})
    for n in range(3):
        writer.register_channel(
            f"/topic_{n}", "cdr", writer.register_schema(f"a/msg/B{n}", "ros2msg", b"int8 x"), {}
        )
    for number, (channel, time_ns, data) in enumerate(messages):
        writer.add_message(channel, time_ns, data, time_ns + 1, number)
        if number == 7:
            writer.flush()
    writer.add_metadata("end", {})
    writer.finish()
    return stream.getvalue()


def written_here(messages: list[tuple[int, int, bytes]]) -> bytes:
    """Return the file of the same messages by McapFile."""
    stream = io.BytesIO()
    file = McapFile(stream, "ros2", "test")
    file.add_metadata("about", {"robot": "chefbot"})
    for n in range(3):
        file.add_channel(f"/topic_{n}", file.add_schema(f"a/msg/B{n}", b"int8 x"), {})
    for number, (channel, time_ns, data) in enumerate(messages):
        file.add_message(channel, time_ns, data, time_ns + 1, number)
        if number == 7:
            file.flush()
    file.add_metadata("end", {})
    file.finish()
    return stream.getvalue()


def test_files_are_those_of_the_library() -> None:
    rng = random.Random(3)
    messages = [
        (rng.randint(1, 3), rng.randint(10**9, 10**10), rng.randbytes(rng.randint(0, 400_000)))
        for _ in range(20)
    ]
    for some in ([], messages[:1], messages):
        assert written_here(some) == written_by_the_library(some)
    log = make_reader(io.BytesIO(written_here(messages)))
    assert [message.data for _, _, message in log.iter_messages(log_time_order=False)] == [
        m[2] for m in messages
    ]

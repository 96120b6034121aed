"""The commands `chefbot bag record`, `play` and `info`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from chefbot.ros2.bag.player import Player
from chefbot.ros2.bag.reader import Bag, read_bag
from chefbot.ros2.bag.recorder import BagRecorder
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.tools.common import (
    ToolError,
    columns,
    console,
    errors,
    full_name,
    graph_node,
    is_hidden,
    stop_event,
)
from chefbot.ros2.tools.topic_echo import quantity
from chefbot.ros2.tools.topic_info import without_tools
from chefbot.storage.atomic_files import StorageError


def run_record(out: Path | None, topics: Sequence[str], include_hidden: bool, seconds: float) -> None:
    """Record topics until Ctrl-C, or for `seconds`.

    The bag is finished properly even when recording fails.
    """
    requested = {full_name(topic) for topic in topics}
    if requested and include_hidden:
        raise ToolError("give topics or --all, not both")
    with graph_node("record") as node, stop_event() as stop:
        writer = BagWriter(out or Path(f"rosbag2_{datetime.now(UTC).astimezone():%Y_%m_%d-%H_%M_%S}"))
        for name in sorted(requested - set(node.wire.graph.topics())):
            errors.print(f"chefbot: {name} has no publisher yet; it is recorded as soon as one appears")
        recorder = BagRecorder(
            node,
            writer,
            lambda name: name in requested if requested else include_hidden or not is_hidden(name),
        )
        try:
            recorder.run(seconds or None, stop)
        except StorageError as error:
            with suppress(StorageError):  # no space for metadata.yaml either; the MCAP file contains it
                writer.close()
            count = sum(writer.counts.values())
            raise ToolError(f"{error}; the {count} messages before are intact") from None
        node.close()
        recorder.write_queued()
        writer.close()
    _print_summary(writer, recorder, requested)


def run_play(path: Path, rate: float, loop: bool, topics: Sequence[str], clock: bool) -> None:
    """Play a bag once, or repeatedly until Ctrl-C.

    With `clock` the recorded time is published on /clock.
    """
    bag = read_bag(path)
    for sentence in bag.truncated:
        errors.print(f"chefbot: {sentence}")
    with graph_node("bag_player", alone=True) as node, stop_event() as stop:
        player = Player(node, bag, topics or _topics_without_publishers(node.wire.graph, bag), clock=clock)
        for sentence in player.skipped_topics:
            errors.print(f"chefbot: not played: {sentence}")
        player.wait_for_subscribers(node)
        while True:
            played = player.play(rate, stop)
            console.print(f"played {played.messages} messages in {played.seconds:.1f} s")
            if not loop or stop.is_set():
                return


def _topics_without_publishers(graph: Graph, bag: Bag) -> list[str]:
    """Return the topics without another publisher.

    A running robot must not receive its own recorded messages, least of all commands.
    """
    live = {name for name, endpoints in graph.topics().items() if without_tools(endpoints.providers)}
    names = sorted({topic.name for topic in bag.topics})
    if left_out := [name for name in names if name in live]:
        errors.print(f"chefbot: not played, because they have publishers now: {', '.join(left_out)}")
    chosen = [name for name in names if name not in live]
    if names and not chosen:
        raise ToolError(
            f"other nodes publish on all topics of {bag.path} now; use another ROS_DOMAIN_ID, or --topics"
        )
    return chosen


def run_info(path: Path) -> int:
    """Print the contents of a bag; return the exit code, 1 if it is truncated."""
    bag = read_bag(path)
    for line in info_lines(bag):
        console.print(line)
    return 1 if bag.truncated else 0


def info_lines(bag: Bag) -> list[str]:
    """Return the lines that `bag info` prints."""
    seconds = max(0, bag.end_ns - bag.start_ns) * 1e-9
    rows = [["topic", "type", "messages", "Hz"]]
    for topic in bag.topics:
        rate = f"{(topic.messages - 1) / seconds:.2f}" if topic.messages > 2 and seconds > 0 else ""
        rows.append([topic.name, topic.kind.name, str(topic.messages), rate])
    files = ", ".join(file.name for file in bag.files)
    return [
        f"{bag.path}: {files}, {quantity(bag.size)}{f', made for {bag.distro}' if bag.distro else ''}",
        f"from {_format_time(bag.start_ns)} to {_format_time(bag.end_ns)}, {seconds:.3f} s, {bag.total} messages",
        *columns(rows),
        *(f"! {sentence}" for sentence in bag.truncated),
    ]


def _format_time(time_ns: int) -> str:
    """Format a time as local time, or as seconds where the clock started with the recording."""
    if time_ns < 10**9 * 365 * 86400:
        return f"{time_ns * 1e-9:.3f} s"
    return f"{datetime.fromtimestamp(time_ns * 1e-9).astimezone():%Y-%m-%d %H:%M:%S}.{time_ns // 10**6 % 1000:03d}"


def _print_summary(writer: BagWriter, recorder: BagRecorder, requested: set[str]) -> None:
    counts = writer.counts
    console.print(f"{writer.out}: {sum(counts.values())} messages on {len(counts)} topics")
    silent = sorted(requested - {name for name, count in counts.items() if count})
    if silent:
        errors.print(f"chefbot: no messages received on {', '.join(silent)}")
    for name, count in recorder.dropped.items():
        errors.print(f"chefbot: the disk was too slow for {name}: {count} messages are lost")

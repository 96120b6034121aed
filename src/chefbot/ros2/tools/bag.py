"""`chefbot bag record`, `play` and `info`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from chefbot.errors import UserError
from chefbot.ros2.bag.player import Player
from chefbot.ros2.bag.reader import Bag, read_bag
from chefbot.ros2.bag.recorder import BagRecorder
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.tools.common import columns, console, errors, full_name, hidden, on_wire, stopping
from chefbot.ros2.tools.topic_info import seen
from chefbot.ros2.tools.topic_listen import quantity


def run_record(out: Path | None, topics: Sequence[str], everything: bool, seconds: float) -> None:
    """Until Ctrl-C, or for so long; what was recorded is whole whatever happens."""
    wanted = {full_name(one) for one in topics}
    if wanted and everything:
        raise UserError("give topics or --all, not both")
    with on_wire("record") as node, stopping() as stop:
        writer = BagWriter(out or Path(f"rosbag2_{datetime.now(UTC).astimezone():%Y_%m_%d-%H_%M_%S}"))
        for name in sorted(wanted - set(node.wire.graph.topics())):
            errors.print(f"chefbot: nobody has {name} yet; it is recorded as soon as somebody speaks there")
        recorder = BagRecorder(
            node, writer, lambda name: name in wanted if wanted else everything or not hidden(name)
        )
        try:
            recorder.run(seconds or None, stop)
        except UserError as full:
            with suppress(UserError):  # no room for metadata.yaml either: the MCAP file says the same
                writer.close()
            kept = sum(writer.counts.values())
            raise UserError(f"{full}; the {kept} messages before are whole") from None
        node.close()
        recorder.write_waiting()
        writer.close()
    _tell(writer, recorder, wanted)


def run_play(path: Path, rate: float, loop: bool, topics: Sequence[str], clock: bool) -> None:
    """Once, or over and over until Ctrl-C. `clock`: with the recorded time on /clock."""
    bag = read_bag(path)
    for sentence in bag.cut:
        errors.print(f"chefbot: {sentence}")
    with on_wire("bag_player", alone=True) as node, stopping() as stop:
        player = Player(node, bag, topics or _not_live(node.wire.graph, bag), clock=clock)
        for sentence in player.left_out:
            errors.print(f"chefbot: not played: {sentence}")
        player.await_listeners(node)
        while True:
            played = player.play(rate, stop)
            console.print(f"played {played.messages} messages in {played.seconds:.1f} s")
            if not loop or stop.is_set():
                return


def _not_live(graph: Graph, bag: Bag) -> list[str]:
    """Topics on which nobody else speaks: a robot that runs must not hear its own past, least of all commands."""
    live = {name for name, named in graph.topics().items() if seen(named.givers)}
    names = sorted({topic.name for topic in bag.topics})
    if left_out := [name for name in names if name in live]:
        errors.print(f"chefbot: not played, since others speak there now: {', '.join(left_out)}")
    chosen = [name for name in names if name not in live]
    if names and not chosen:
        raise UserError(
            f"others speak on all topics of {bag.path} now; play it under another ROS_DOMAIN_ID, or name --topics"
        )
    return chosen


def run_info(path: Path) -> int:
    """What is in it. Exit code: 1 if it is cut off."""
    bag = read_bag(path)
    for line in info_lines(bag):
        console.print(line)
    return 1 if bag.cut else 0


def info_lines(bag: Bag) -> list[str]:
    """What `bag info` prints."""
    seconds = max(0, bag.end_ns - bag.start_ns) * 1e-9
    rows = [["topic", "type", "messages", "Hz"]]
    for topic in bag.topics:
        rate = f"{(topic.messages - 1) / seconds:.2f}" if topic.messages > 2 and seconds > 0 else ""
        rows.append([topic.name, topic.kind.name, str(topic.messages), rate])
    files = ", ".join(file.name for file in bag.files)
    return [
        f"{bag.path}: {files}, {quantity(bag.size)}{f', made for {bag.distro}' if bag.distro else ''}",
        f"from {_when(bag.start_ns)} to {_when(bag.end_ns)}, {seconds:.3f} s, {bag.total} messages",
        *columns(rows),
        *(f"! {one}" for one in bag.cut),
    ]


def _when(time_ns: int) -> str:
    """Local time, or seconds where the clock began with the recording."""
    if time_ns < 10**9 * 365 * 86400:
        return f"{time_ns * 1e-9:.3f} s"
    return f"{datetime.fromtimestamp(time_ns * 1e-9).astimezone():%Y-%m-%d %H:%M:%S}.{time_ns // 10**6 % 1000:03d}"


def _tell(writer: BagWriter, recorder: BagRecorder, wanted: set[str]) -> None:
    counts = writer.counts
    console.print(f"{writer.out}: {sum(counts.values())} messages on {len(counts)} topics")
    silent = sorted(wanted - {name for name, count in counts.items() if count})
    if silent:
        errors.print(f"chefbot: nothing came on {', '.join(silent)}")
    for name, count in recorder.lost.items():
        errors.print(f"chefbot: the disk was too slow for {name}: {count} messages are lost")

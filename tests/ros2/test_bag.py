"""Bags: what is recorded is what was published, and an independent reader finds it too."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from tests.support.waiting import PATIENCE, wait_for

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.player import Player
from chefbot.ros2.bag.qos_profile import parse_qos_profiles, qos_profiles_to_yaml
from chefbot.ros2.bag.reader import read_bag
from chefbot.ros2.bag.recorder import BagRecorder
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, DEFAULT, ROSOUT, SENSOR_DATA, TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext

TWIST, TEXT = InterfaceType.of(Twist), InterfaceType.of(String)
FOREIGN = InterfaceType("their_msgs/msg/Thing", "RIHS01_" + "ab" * 32)
NEVER = threading.Event()


def write(out: Path, count: int = 100) -> list[bytes]:
    """A bag of twists, 10 ms apart, each with its number."""
    writer = BagWriter(out)
    writer.add_topic("/cmd_vel", TWIST, [DEFAULT])
    encoded = [Twist.of(0.01 * number, 0.0).to_cdr() for number in range(count)]
    for number, data in enumerate(encoded):
        writer.add("/cmd_vel", TWIST, data, 10**18 + number * 10**7, 10**18)
        if number % 10 == 9:
            writer.flush()
    writer.close()
    return encoded


def test_messages_are_recorded_and_played_back(wire: RmwContext, port: int, tmp_path: Path) -> None:
    with (
        RmwContext(port=port, router=False) as far,
        RmwNode(far, "talker") as talker,
        RmwNode(wire, "_rec") as rec,
    ):
        talker.publisher("map_name", String, TRANSIENT_LOCAL_QOS).publish(String("hotel"))
        publisher = talker.publisher("cmd_vel", Twist)
        assert wire.graph.wait_for(lambda graph: {"/map_name", "/cmd_vel"} <= graph.topics().keys(), PATIENCE)
        writer, stop = BagWriter(tmp_path / "bag"), threading.Event()
        recorder = BagRecorder(rec, writer, lambda name: name != "/left_out")
        thread = threading.Thread(target=recorder.run, args=(None, stop))
        thread.start()
        wait_for(lambda: publisher.has_subscribers)
        for number in range(50):
            publisher.publish(Twist.of(0.1 * number, 1.0))
        late = talker.raw_publisher("late", FOREIGN)
        talker.publisher("left_out", String, TRANSIENT_LOCAL_QOS).publish(String("x"))
        wait_for(lambda: late.has_subscribers)
        late.publish_cdr(b"\0\1\0\0anything")
        wait_for(lambda: writer.counts.get("/late") == 1 and writer.counts.get("/cmd_vel") == 50)
        wait_for(lambda: writer.counts.get("/map_name") == 1)
        stop.set()
        thread.join()
        writer.close()
        assert set(writer.counts) == {"/map_name", "/cmd_vel", "/late"} and not recorder.dropped
    bag = read_bag(tmp_path / "bag")
    assert not bag.truncated and bag.total == 52
    twists = [Twist.from_cdr(one.data).linear.x for one in bag.messages(["/cmd_vel"])]
    assert twists == [0.1 * number for number in range(50)]
    (thing,) = bag.messages(["/late"])
    assert (
        thing.kind == FOREIGN
        and thing.data == b"\0\1\0\0anything"
        and thing.publish_time_ns <= thing.log_time_ns
    )


def test_an_independent_reader_reads_the_bag(tmp_path: Path) -> None:
    out = tmp_path / "bag"
    written = write(out)
    with AnyReader([out]) as reader:
        (connection,) = reader.connections
        found = [(reader.deserialize(raw, one.msgtype).linear.x, at) for one, at, raw in reader.messages()]
        assert reader.message_count == 100 and reader.duration == 99 * 10**7 + 1
    assert (connection.topic, connection.msgtype) == ("/cmd_vel", "geometry_msgs/msg/Twist")
    assert connection.digest == TWIST.hash
    (profile,) = connection.ext.offered_qos_profiles
    assert (profile.depth, profile.reliability) == (10, QosReliability.RELIABLE)
    assert found == [(Twist.from_cdr(data).linear.x, 10**18 + n * 10**7) for n, data in enumerate(written)]


def test_the_metadata_has_the_fields_of_version_9(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    (key, about), *rest = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text()).items()
    assert key == "rosbag2_bagfile_information" and not rest
    assert list(about) == [
        "version", "storage_identifier", "duration", "starting_time", "message_count", "topics_with_message_count",
        "compression_format", "compression_mode", "relative_file_paths", "files", "custom_data", "ros_distro",
    ]  # fmt: skip
    assert (about["version"], about["storage_identifier"], about["message_count"]) == (9, "mcap", 100)
    assert about["duration"] == {"nanoseconds": 99 * 10**7}
    assert about["starting_time"] == {"nanoseconds_since_epoch": 10**18}
    (topic,) = about["topics_with_message_count"]
    forever = {"sec": 9223372036, "nsec": 854775807}
    assert topic["topic_metadata"]["offered_qos_profiles"] == [
        {
            "history": "keep_last", "depth": 10, "reliability": "reliable", "durability": "volatile",
            "deadline": forever, "lifespan": forever, "liveliness": "automatic",
            "liveliness_lease_duration": forever, "avoid_ros_namespace_conventions": False,
        }
    ]  # fmt: skip
    assert "&" not in (tmp_path / "bag" / "metadata.yaml").read_text()


@pytest.mark.parametrize("offers", [[DEFAULT], [SENSOR_DATA, TRANSIENT_LOCAL_QOS], [ROSOUT], []])
def test_offered_qos_profiles_read_back(offers: list, tmp_path: Path) -> None:
    assert parse_qos_profiles(qos_profiles_to_yaml(offers)) == offers
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic("/x", TEXT, offers)
    writer.add("/x", TEXT, String("a").to_cdr(), 1, 1)
    writer.close()
    for path in (tmp_path / "bag", tmp_path / "bag" / "bag_0.mcap"):
        with AnyReader([path]) as reader:
            theirs = reader.connections[0].ext.offered_qos_profiles
        assert [(one.depth, one.durability is QosDurability.TRANSIENT_LOCAL) for one in theirs] == [
            (one.depth, one.latched) for one in offers
        ]


def test_numeric_qos_profiles_are_read() -> None:
    old = (
        "- history: 1\n  depth: 7\n  reliability: 2\n  durability: 1\n  deadline: {sec: 2147483647, nsec: 1}"
    )
    (one,) = parse_qos_profiles(old)
    assert one == SENSOR_DATA._replace(depth=7, durability=TRANSIENT_LOCAL_QOS.durability)
    assert parse_qos_profiles("nonsense: [") == parse_qos_profiles("") == []


@given(st.integers(0, 10**6))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_truncated_file_gives_all_complete_chunks(
    tmp_path_factory: pytest.TempPathFactory, at: int
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    written = write(folder / "whole.mcap")
    data = (folder / "whole.mcap").read_bytes()
    at %= len(data)
    (folder / "cut.mcap").write_bytes(data[:at])
    try:
        bag = read_bag(folder / "cut.mcap")
    except BagError as error:
        assert "cut off before its first message" in str(error) and at < 2000
        return
    assert len(bag.truncated) == 1 and "was cut off" in bag.truncated[0]
    kept = [one.data for one in bag.messages()]
    assert kept == written[: bag.total] and bag.total % 10 == 0


def test_a_complete_file_beside_a_truncated_one_is_read(tmp_path: Path) -> None:
    """Also where its name is a part of the other's."""
    complete, truncated = tmp_path / "a.mcap", tmp_path / "a.mcap.mcap"
    write(tmp_path / "whole.mcap")
    data = (tmp_path / "whole.mcap").read_bytes()
    complete.write_bytes(data)
    truncated.write_bytes(data[: len(data) // 2])
    bag = read_bag(tmp_path)
    assert bag.truncated_files == {truncated}
    damaged = bytearray(data)
    damaged[len(data) // 3 : len(data) // 2] = b"\xff" * (len(data) // 2 - len(data) // 3)
    complete.write_bytes(damaged)
    with pytest.raises(BagError, match="is damaged after"):
        list(bag.messages())


@given(st.integers(0, 10**6), st.integers(0, 7))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, at: int, bit: int
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    write(folder / "bag.mcap", 30)
    data = bytearray((folder / "bag.mcap").read_bytes())
    data[at % len(data)] ^= 1 << bit
    (folder / "bag.mcap").write_bytes(data)
    try:
        bag = read_bag(folder / "bag.mcap")
        assert sum(1 for _ in bag.messages()) <= 31
    except BagError as error:
        assert str(folder / "bag.mcap") in str(error)


def test_a_truncated_bag_is_played_to_its_end(wire: RmwContext, port: int, tmp_path: Path) -> None:
    written = write(tmp_path / "whole.mcap")
    data = (tmp_path / "whole.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    bag = read_bag(tmp_path / "cut.mcap")
    assert 0 < bag.total < 100
    received: list[Twist] = []
    with (
        RmwContext(port=port, router=False) as far,
        RmwNode(far, "ear") as ear,
        RmwNode(wire, "_play") as node,
    ):
        ear.subscription("cmd_vel", Twist, received.append)
        assert wire.graph.wait_for(lambda graph: "/cmd_vel" in graph.topics(), PATIENCE)
        player = Player(node, bag)
        player.wait_for_subscribers(node)
        assert player.play(100.0, NEVER).messages == bag.total
        wait_for(lambda: len(received) == bag.total)
    assert [one.to_cdr() for one in received] == written[: bag.total]


def test_a_bag_plays_at_the_given_rate_and_can_be_stopped(wire: RmwContext, tmp_path: Path) -> None:
    write(tmp_path / "bag.mcap")
    with RmwNode(wire, "_play") as node:
        player = Player(node, read_bag(tmp_path / "bag.mcap"))
        assert player.play(4.0, NEVER).seconds >= 0.99 / 4.0
        stop = threading.Event()
        stop.set()
        assert player.play(0.01, stop).messages == 0


@pytest.mark.slow
def test_the_clock_is_published_while_a_bag_plays(wire: RmwContext, tmp_path: Path) -> None:
    write(tmp_path / "bag.mcap", 100)
    times: list[int] = []
    with RmwNode(wire, "player") as node, RmwNode(wire, "listener") as listener:
        listener.subscription("/clock", Clock, lambda message: times.append(message.clock.ns), CLOCK)
        bag = read_bag(tmp_path / "bag.mcap")
        player = Player(node, bag, clock=True)
        player.wait_for_subscribers(node)
        player.play(1.0, threading.Event())
    assert times == sorted(times) and len(times) > 5
    assert bag.start_ns <= times[0] <= times[-1] <= bag.end_ns
    assert times[-1] - times[0] > 0.8 * (bag.end_ns - bag.start_ns)


def test_unplayable_topics_are_reported_and_skipped(wire: RmwContext, tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        unknown = writer.register_schema("their_msgs/Thing", "ros2msg", b"int32 x")
        known = writer.register_schema("std_msgs/String", "ros2msg", b"string data")
        for topic, encoding, schema in (("/a", "cdr", unknown), ("/b", "json", 0), ("no name", "cdr", known)):
            writer.add_message(writer.register_channel(topic, encoding, schema), 1, b"\0\1\0\0", 1)
        writer.add_message(writer.register_channel("/text", "cdr", known), 2, String("a").to_cdr(), 2)
        writer.finish()
    with RmwNode(wire, "_play") as node:
        player = Player(node, read_bag(path))
        assert len(player.skipped_topics) == 3 and player.play(1.0, NEVER).messages == 1
        assert "their_msgs/msg/Thing" in player.skipped_topics[0] and "json" in player.skipped_topics[1]
        with pytest.raises(BagError, match="did you mean '/text'"):
            Player(node, read_bag(path), ["/txt"])
        with pytest.raises(BagError, match="nothing of"):
            Player(node, read_bag(path), ["/a"])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("rosbag2_bagfile_information: {storage_identifier: sqlite3}", "stored as sqlite3"),
        ("rosbag2_bagfile_information: {storage_identifier: mcap, compression_mode: file}", "is compressed"),
        ("nothing: [", "is not bag metadata"),
        (
            "rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: [x.mcap]}",
            "does not exist",
        ),
        (None, "contains no bag"),
    ],
)
def test_other_folders_are_refused_in_one_sentence(text: str | None, sentence: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "metadata.yaml").write_text(text)
    with pytest.raises(BagError, match=sentence):
        read_bag(tmp_path)


def test_an_existing_bag_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="exists already"):
        BagWriter(tmp_path)


RECORD = "from chefbot.cli.app import main; main()"


def start_recording(wire: RmwContext, out: Path, **more: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", RECORD, "bag", "record", "-o", str(out), "--duration", "60"]
    environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(wire._port), "ROS_DOMAIN_ID": str(wire.domain)}
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, **more)  # type: ignore[call-overload]


def talk(node: RmwNode, ended: Callable[[], bool]) -> None:
    """Large scans that do not compress well, until `ended`."""
    publisher = node.publisher("scan", LaserScan)
    until, number = time.monotonic() + 2 * PATIENCE, 0
    while not ended() and time.monotonic() < until:
        number += 1
        publisher.publish(LaserScan(ranges=[float(hash((number, k)) % 9973) for k in range(2000)]))
        time.sleep(0.004)


def messages_so_far(bag: Path) -> int:
    """Number of messages that the file of a recording holds; its first chunk is written in pieces."""
    try:
        return read_bag(bag).total
    except BagError:
        return 0


@pytest.mark.slow
def test_a_killed_recording_is_readable(wire: RmwContext, tmp_path: Path) -> None:
    with RmwNode(wire, "talker") as talker:
        process = start_recording(wire, tmp_path / "bag")
        talk(talker, lambda: messages_so_far(tmp_path / "bag") > 10)
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=PATIENCE)
    bag = read_bag(tmp_path / "bag")
    assert bag.total > 10 and bag.truncated
    assert len({LaserScan.from_cdr(one.data).ranges.tobytes() for one in bag.messages()}) == bag.total


@pytest.mark.slow
def test_a_full_disk_ends_a_recording_in_one_sentence(wire: RmwContext, tmp_path: Path) -> None:
    """A file that may not grow beyond some bytes stands for a disk that is full."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (600_000, 600_000))

    with RmwNode(wire, "talker") as talker:
        process = start_recording(wire, tmp_path / "bag", preexec_fn=limit)
        talk(talker, lambda: process.poll() is not None)
        stderr = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 2
    assert stderr.splitlines()[-1].startswith("chefbot: recording") and "Traceback" not in stderr
    bag = read_bag(tmp_path / "bag")
    assert not bag.truncated and f"the {bag.total} messages before are intact" in stderr


@pytest.mark.slow
def test_a_bag_plays_without_any_subscriber(port: int, tmp_path: Path) -> None:
    write(tmp_path / "bag.mcap")
    command = [
        sys.executable,
        "-m",
        "chefbot",
        "bag",
        "play",
        str(tmp_path / "bag.mcap"),
        "--loop",
        "--clock",
    ]
    environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(port), "ROS_DOMAIN_ID": "0"}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    received: list[Twist] = []
    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "late") as node:
        node.subscription("/cmd_vel", Twist, received.append)
        wait_for(lambda: len(received) > 10)
        assert "/bag_player" in {one.full_name for one in wire.graph.nodes()}
    process.send_signal(signal.SIGINT)
    assert "played" in process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 0

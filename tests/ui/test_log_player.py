"""The player of a log: what is due, and what was known at a time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.runtime.recorded_log import LoggedMessage
from chefbot.ui.playback.log_player import TF_SPAN_NS, LogPlayer

SECOND = 1_000_000_000


def logged(topic: str, time_ns: int, publisher: str = "node") -> LoggedMessage:
    return LoggedMessage(
        topic, "std_msgs/msg/String", str(time_ns).encode(), time_ns, publisher, False, False
    )


LOGS = st.lists(
    st.tuples(st.sampled_from(["scan", "map", "causes"]), st.integers(5, 30)).map(
        lambda event: logged(event[0], event[1] * SECOND)
    ),
    min_size=1,
    max_size=40,
)


@given(log=LOGS, steps=st.lists(st.floats(0, 8), max_size=12))
def test_every_message_is_played_once_and_in_order(log: list[LoggedMessage], steps: list[float]) -> None:
    player = LogPlayer(log)
    played = list(player.advance(player.begin_ns))
    for step in steps:
        played += player.advance(player.now_ns + round(step * SECOND))
        assert all(message.time_ns <= player.now_ns for message in played)
    played += player.advance(player.end_ns)
    assert played == sorted(log, key=lambda message: message.time_ns) and player.at_end


@given(log=LOGS, time=st.integers(0, 40), before=st.integers(0, 40))
def test_a_jump_gives_the_latest_of_each_topic(log: list[LoggedMessage], time: int, before: int) -> None:
    player = LogPlayer(log)
    player.jump(before * SECOND)
    known = player.jump(time * SECOND)
    at = min(max(time * SECOND, player.begin_ns), player.end_ns)
    past = sorted((message for message in log if message.time_ns <= at), key=lambda message: message.time_ns)
    for topic in ("scan", "map"):
        assert [one for one in known if one.topic == topic] == [one for one in past if one.topic == topic][
            -1:
        ]
    assert [one for one in known if one.topic == "causes"] == [one for one in past if one.topic == "causes"]
    rest = player.advance(player.end_ns)
    assert len(rest) == len(log) - len(past), "and continues from there"


def test_a_jump_gives_the_transforms_of_the_last_seconds() -> None:
    times = [0, 1, TF_SPAN_NS, TF_SPAN_NS + SECOND, 2 * TF_SPAN_NS]
    player = LogPlayer([logged("tf", time) for time in times])
    assert [one.time_ns for one in player.jump(2 * TF_SPAN_NS)] == times[1:], "and the last before"


def test_the_control_of_the_recorded_launch_is_not_played() -> None:
    player = LogPlayer([logged("chefbot/restart", 1), logged("scan", 2)])
    assert [one.topic for one in player.advance(2)] == ["scan"]
    assert LogPlayer([]).at_end

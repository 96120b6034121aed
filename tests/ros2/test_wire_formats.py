"""Whatever is written can be read back; whatever else is read is refused with a RmwError and nothing worse."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from chefbot.ros2.rmw.attachment import Attachment, parse
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.liveliness import EndpointInfo, NodeId, Token, parse_token
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import INFINITE, QoS, QosDuration, incompatible, parse_qos

word = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True)
path = st.lists(word, min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))
maybe_root = st.one_of(st.just("/"), path)
small = st.integers(0, 5)
number = st.integers(0, 2**63 - 1)
span = st.builds(QosDuration, number, st.integers(0, 999_999_999))
qos = st.builds(QoS, small, small, small, number, span, span, small, span)
types = st.builds(
    lambda package, folder, name, digest: InterfaceType(f"{package}/{folder}/{name}", f"RIHS01_{digest}"),
    word, st.sampled_from(["msg", "srv", "action"]), word, st.from_regex(r"[0-9a-f]{64}", fullmatch=True),
)  # fmt: skip
ids = st.integers(0, 10**6).map(str)
zid = st.from_regex(r"[1-9a-f][0-9a-f]{0,31}", fullmatch=True)
nodes = st.builds(NodeId, st.integers(0, 232), zid, ids, maybe_root, word, maybe_root)
ends = st.builds(
    EndpointInfo, ids, st.sampled_from(["MP", "MS", "SS", "SC"]), path, types, qos,
    st.sampled_from(["", "backends:cpu:", "backends:cpu:;cuda:x"]),
)  # fmt: skip
tokens = st.builds(Token, nodes, st.one_of(st.none(), ends))


@given(qos)
def test_qos_round_trips(one: QoS) -> None:
    assert parse_qos(str(one)) == one
    assert incompatible(one, one) == []


@given(tokens)
def test_liveliness_tokens_round_trip(token: Token) -> None:
    assert parse_token(str(token)) == token
    assert len(token.gid) == 16


@given(tokens, st.integers(0, 400), st.text(max_size=3), st.integers(0, 3))
def test_damaged_tokens_are_refused_or_parse(token: Token, place: int, put: str, cut: int) -> None:
    text = str(token)
    place %= len(text) + 1
    damaged = text[:place] + put + text[place + cut :]
    try:
        read = parse_token(damaged)
    except RmwError:
        return
    assert parse_token(str(read)) == read


@given(
    st.text(max_size=60) | st.text("0123456789:,-", max_size=40), st.sampled_from([parse_token, parse_qos])
)
def test_any_text_is_refused_or_parses(text: str, parser: Callable[[str], Token | QoS]) -> None:
    try:
        read = parser(text)
    except RmwError:
        return
    assert parser(str(read)) == read


@given(
    st.integers(-(2**63), 2**63 - 1), st.integers(-(2**63), 2**63 - 1), st.binary(min_size=16, max_size=16)
)
def test_attachments_round_trip(sequence: int, stamp: int, gid: bytes) -> None:
    one = Attachment(sequence, stamp, gid)
    assert parse(one.pack()) == one


@given(st.binary(max_size=40))
def test_any_bytes_are_an_attachment_or_refused(data: bytes) -> None:
    try:
        one = parse(data)
    except RmwError:
        return
    assert one.pack() == data


def test_best_available_subscriptions_match_every_publisher() -> None:
    """As rmw_zenoh writes a subscription with BEST_AVAILABLE: markers, no times."""
    marker = "9223372036,854775806"
    requested = parse_qos(f"4:4:1,10:{marker}:,:5,{marker}")
    for offered in (
        QoS(),
        QoS(reliability=2),
        QoS(liveliness=3, lease=QosDuration(1, 0)),
        QoS(deadline=QosDuration(1, 0)),
    ):
        assert incompatible(offered, requested) == []
        assert (
            incompatible(requested, offered._replace(deadline=INFINITE, lease=INFINITE, liveliness=1)) == []
        )

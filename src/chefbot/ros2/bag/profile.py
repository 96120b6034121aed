"""QoS as rosbag2 writes it into bags: YAML with every field, policies by name since version 9, by number before."""

from __future__ import annotations

from typing import Any

import yaml

from chefbot.ros2.rmw.qos import INFINITE, QoS, Span

HISTORY = ("system_default", "keep_last", "keep_all", "unknown")
RELIABILITY = ("system_default", "reliable", "best_effort", "unknown", "best_available")
DURABILITY = ("system_default", "transient_local", "volatile", "unknown", "best_available")
LIVELINESS = ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available")
"""Names by number (rmw/types.h, rmw/qos_string_conversions.h)."""
Profile = dict[str, Any]


def to_profile(qos: QoS) -> Profile:
    """All fields, in rosbag2's order."""
    return {
        "history": HISTORY[qos.history],
        "depth": qos.depth,
        "reliability": RELIABILITY[qos.reliability],
        "durability": DURABILITY[qos.durability],
        "deadline": _span(qos.deadline),
        "lifespan": _span(qos.lifespan),
        "liveliness": LIVELINESS[qos.liveliness],
        "liveliness_lease_duration": _span(qos.lease),
        "avoid_ros_namespace_conventions": False,
    }


def profiles_text(offers: list[QoS]) -> str:
    """As it stands beside a channel of the MCAP file."""
    return yaml.safe_dump([to_profile(one) for one in offers], sort_keys=False).strip()


def read_profiles(text: str) -> list[QoS]:
    """Of any version; what is left out, unknown or left to the system has ROS's defaults."""
    try:
        plain = yaml.safe_load(text)
    except yaml.YAMLError:
        return []
    return [_read(one) for one in plain if isinstance(one, dict)] if isinstance(plain, list) else []


def _read(profile: Profile) -> QoS:
    reliability = _number(profile.get("reliability"), RELIABILITY, 2)
    durability = _number(profile.get("durability"), DURABILITY, 2)
    depth = profile.get("depth")
    return QoS(
        reliability=reliability or QoS().reliability,
        durability=durability or QoS().durability,
        history=_number(profile.get("history"), HISTORY, 2) or QoS().history,
        depth=depth if isinstance(depth, int) and 0 < depth < 1_000_000 else 10,
        deadline=_read_span(profile.get("deadline")),
        lifespan=_read_span(profile.get("lifespan")),
    )


def _number(policy: Any, names: tuple[str, ...], last: int) -> int:
    """0 for what is none of ours."""
    number = names.index(policy) if policy in names else policy
    return number if isinstance(number, int) and 0 < number <= last else 0


def _span(span: Span) -> dict[str, int]:
    return {"sec": span.sec, "nsec": span.nanosec}


def _read_span(plain: Any) -> Span:
    """Some old bags write "for ever" as the most that 31 or 63 bits hold, or as nothing."""
    sec, nanosec = (plain.get(key) for key in ("sec", "nsec")) if isinstance(plain, dict) else (0, 0)
    if not isinstance(sec, int) or not isinstance(nanosec, int) or sec + nanosec <= 0:
        return INFINITE
    return INFINITE if sec >= 2**31 - 1 else Span(sec, nanosec)

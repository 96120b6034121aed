"""QoS profiles as rosbag2 writes them into bags: YAML with every field.

Policies are written by name since version 9, by number before.
"""

from __future__ import annotations

from typing import Any

import yaml

from chefbot.config import ConfigError, parse_yaml
from chefbot.ros2.rmw.qos import INFINITE, QoS, QosDuration

HISTORY = ("system_default", "keep_last", "keep_all", "unknown")
RELIABILITY = ("system_default", "reliable", "best_effort", "unknown", "best_available")
DURABILITY = ("system_default", "transient_local", "volatile", "unknown", "best_available")
LIVELINESS = ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available")
"""Policy names by number (rmw/types.h, rmw/qos_string_conversions.h)."""
Profile = dict[str, Any]


def qos_to_profile(qos: QoS) -> Profile:
    """Return the profile of a QoS with all fields, in rosbag2's order."""
    return {
        "history": HISTORY[qos.history],
        "depth": qos.depth,
        "reliability": RELIABILITY[qos.reliability],
        "durability": DURABILITY[qos.durability],
        "deadline": _duration(qos.deadline),
        "lifespan": _duration(qos.lifespan),
        "liveliness": LIVELINESS[qos.liveliness],
        "liveliness_lease_duration": _duration(qos.lease),
        "avoid_ros_namespace_conventions": False,
    }


def qos_profiles_to_yaml(offers: list[QoS]) -> str:
    """Return the YAML text of QoS profiles in the metadata of an MCAP channel."""
    return yaml.safe_dump([qos_to_profile(offer) for offer in offers], sort_keys=False).strip()


def parse_qos_profiles(text: str) -> list[QoS]:
    """Parse the QoS profiles of any rosbag2 version.

    Missing or unknown policies and system defaults become ROS's defaults.
    """
    try:
        profiles = parse_yaml(text.encode(), "QoS profiles")
    except ConfigError:
        return []
    if not isinstance(profiles, list):
        return []
    return [_read(profile) for profile in profiles if isinstance(profile, dict)]


def _read(profile: Profile) -> QoS:
    reliability = _number(profile.get("reliability"), RELIABILITY, 2)
    durability = _number(profile.get("durability"), DURABILITY, 2)
    depth = profile.get("depth")
    return QoS(
        reliability=reliability or QoS().reliability,
        durability=durability or QoS().durability,
        history=_number(profile.get("history"), HISTORY, 2) or QoS().history,
        depth=depth if isinstance(depth, int) and 0 < depth < 1_000_000 else 10,
        deadline=_read_duration(profile.get("deadline")),
        lifespan=_read_duration(profile.get("lifespan")),
    )


def _number(policy: Any, names: tuple[str, ...], max_number: int) -> int:
    """Return the number of a policy given by name or number; 0 if it is not supported."""
    number = names.index(policy) if policy in names else policy
    return number if isinstance(number, int) and 0 < number <= max_number else 0


def _duration(span: QosDuration) -> dict[str, int]:
    return {"sec": span.sec, "nsec": span.nanosec}


def _read_duration(duration: Any) -> QosDuration:
    """Parse a duration; some old bags write infinity as the maximum of 31 or 63 bits, or leave it out."""
    sec, nanosec = (duration.get(key) for key in ("sec", "nsec")) if isinstance(duration, dict) else (0, 0)
    if not isinstance(sec, int) or not isinstance(nanosec, int) or sec + nanosec <= 0:
        return INFINITE
    return INFINITE if sec >= 2**31 - 1 else QosDuration(sec, nanosec)

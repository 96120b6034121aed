"""Who may say what: Zenoh's access control for the gate of one machine, from the fleet's list. Default: nothing.

Zenoh asks at the gate, for each message that comes in or goes out, whose certificate the other end has
(https://zenoh.io/docs/manual/access-control). A robot may only use keys below its own name: /robot1/scan,
/robot1/cmd_vel, and the liveliness tokens of nodes in /robot1. Besides it may tell, but not hear, on the two topics
that ROS 2 has for all nodes together, /rosout and /parameter_events. Operators and the site's router may do all.
"""

from __future__ import annotations

from typing import Any

from chefbot.fleet.membership import Fleet

MESSAGES = [
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
]
TOKENS = "@ros2_lv/**"
TELLING = ["put", "declare_queryable", "reply", "liveliness_token"]
ASKING = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"]
SHARED = ["*/rosout/**", "*/rosout/**/@adv/**", "*/parameter_events/**"]
LOCAL = "this machine"


def own_keys(robot: str) -> list[str]:
    """Key expressions below a robot's name, in any ROS domain; `**` does not reach into `@` chunks by itself."""
    token = f"@ros2_lv/*/*/*/*/*/*/%{robot}"
    return [f"*/{robot}/**", f"*/{robot}/**/@adv/**", f"{token}/**", f"{token}%$*/**"]


def access_control(fleet: Fleet, me: str) -> dict[str, Any]:
    """The part `access_control` of a Zenoh configuration for the gate of member `me`."""
    rules = [
        _rule("all", MESSAGES, ["ingress", "egress"], ["**", "**/@adv/**", TOKENS]),
        _rule(
            "ask who is there", ["declare_liveliness_subscriber", "liveliness_query"], ["ingress"], [TOKENS]
        ),
        _rule("tell all", TELLING, ["ingress"], SHARED),
        _rule("be asked", ASKING, ["egress"], SHARED),
        _rule("hear who is there", ["liveliness_token", "reply"], ["egress"], [TOKENS]),
    ]
    subjects: list[dict[str, Any]] = [{"id": LOCAL, "link_protocols": ["tcp"], "interfaces": ["lo"]}]
    policies = [{"rules": ["all"], "subjects": [LOCAL]}]
    for member, role in sorted(fleet.members.items()):
        if member != me:
            subjects.append({"id": member, "cert_common_names": [member]})
            policies.append({"rules": _allowed(member, role, rules), "subjects": [member]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _allowed(member: str, role: str, rules: list[dict[str, Any]]) -> list[str]:
    if role != "robot":
        return ["all"]
    rules.append(_rule(f"below {member}", MESSAGES, ["ingress", "egress"], own_keys(member)))
    return [f"below {member}", "ask who is there", "hear who is there", "tell all", "be asked"]


def _rule(name: str, messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "messages": messages, "flows": flows, "key_exprs": keys}

"""Access control between machines: the rules for one machine's secure router (Zenoh ACL). Default: deny.

For each message that comes in or goes out Zenoh matches the common name of the other end's certificate
(https://zenoh.io/docs/manual/access-control). It contains the serial number, so only the one valid
certificate of each member has rights; those that were removed or replaced have none. A robot may only use
keys below its own name: /robot1/scan, /robot1/cmd_vel, and the liveliness tokens of nodes in /robot1. Besides
it may publish, but not receive, on the two topics that ROS 2 has for all nodes together, /rosout and
/parameter_events. Operators and the site's router may do everything.
"""

from __future__ import annotations

from typing import Any

from chefbot.fleet.certificates import CertificateId
from chefbot.fleet.membership import Fleet, Role

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
"""All message types of Zenoh's access control."""
TOKENS = "@ros2_lv/**"
"""Key expression of all liveliness tokens of rmw_zenoh."""
PUBLISHING = ["put", "declare_queryable", "reply", "liveliness_token"]
"""Message types that a publisher sends."""
SUBSCRIBING = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"]
"""Message types that a subscriber sends."""
SHARED_TOPICS = ["*/rosout/**", "*/rosout/**/@adv/**", "*/parameter_events/**"]
"""Key expressions of the topics that all nodes of ROS 2 share."""
LOCALHOST_SUBJECT = "this machine"


def own_keys(robot: str) -> list[str]:
    """Return the key expressions below a robot's name, in any ROS domain.

    `**` does not match chunks that begin with `@`, so these are listed too.
    """
    token = f"@ros2_lv/*/*/*/*/*/*/%{robot}"
    return [f"*/{robot}/**", f"*/{robot}/**/@adv/**", f"{token}/**", f"{token}%$*/**"]


def access_control(fleet: Fleet, me: str) -> dict[str, Any]:
    """Return the section `access_control` of the Zenoh configuration for the secure router of member `me`."""
    rules = [
        _rule("all", MESSAGES, ["ingress", "egress"], ["**", "**/@adv/**", TOKENS]),
        _rule(
            "query liveliness", ["declare_liveliness_subscriber", "liveliness_query"], ["ingress"], [TOKENS]
        ),
        _rule("publish shared", PUBLISHING, ["ingress"], SHARED_TOPICS),
        _rule("serve shared", SUBSCRIBING, ["egress"], SHARED_TOPICS),
        _rule("receive liveliness", ["liveliness_token", "reply"], ["egress"], [TOKENS]),
    ]
    subjects: list[dict[str, Any]] = [
        {"id": LOCALHOST_SUBJECT, "link_protocols": ["tcp"], "interfaces": ["lo"]}
    ]
    policies = [{"rules": ["all"], "subjects": [LOCALHOST_SUBJECT]}]
    for name, member in sorted(fleet.members.items()):
        if name != me:
            certificate = CertificateId(name, member.serial)
            subjects.append({"id": name, "cert_common_names": [certificate.common_name]})
            policies.append({"rules": _rules_for(name, member.role, rules), "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rules_for(member: str, role: Role, rules: list[dict[str, Any]]) -> list[str]:
    if role != "robot":
        return ["all"]
    rules.append(_rule(f"below {member}", MESSAGES, ["ingress", "egress"], own_keys(member)))
    return [f"below {member}", "query liveliness", "receive liveliness", "publish shared", "serve shared"]


def _rule(name: str, messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "messages": messages, "flows": flows, "key_exprs": keys}

"""The messages and actions of `chefbot_msgs` in ROS 2's interface format, with the docstrings as comments.

Format: https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html. The fields are those of the classes,
so ROS 2 calculates the same type hashes.
"""

from __future__ import annotations

import inspect

from chefbot.msgs import chefbot_msgs
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.definition import interface_text
from chefbot.msgs.idl.message import Message


def interface_files() -> dict[str, str]:
    """Return the path in the package and the text of every .msg and .action file."""
    files: dict[str, str] = {}
    for kind in vars(chefbot_msgs).values():
        if isinstance(kind, Action):
            parts = (_commented(part) for part in (kind.goal, kind.result, kind.feedback))
            files[f"action/{kind.name}.action"] = "---\n".join(parts)
        elif _is_message(kind):
            files[f"msg/{kind.__name__}.msg"] = _commented(kind)
    return files


def _is_message(kind: object) -> bool:
    """Whether a name of the module is a message of the package: not one of another, not a part of an action."""
    if not (isinstance(kind, type) and issubclass(kind, Message)):
        return False
    return kind.ros_package() == "chefbot_msgs" and "_" not in kind.__name__


def _commented(kind: type[Message]) -> str:
    comment = "".join(
        f"# {line}".rstrip() + "\n" for line in inspect.cleandoc(kind.__doc__ or "").splitlines()
    )
    return comment + interface_text(kind)

"""The package `chefbot_msgs`: our own message and action types, for ROS 2 to build: same fields, so same hashes.

Form: https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable

from chefbot.design.export.ros2.package import manifest
from chefbot.msgs import chefbot_msgs
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.definition import describe
from chefbot.msgs.idl.definition import interface_text as fields_text
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Message

PACKAGE = "chefbot_msgs"
ABOUT = "What chefbot's nodes say that ROS 2 has no message for, written by chefbot."
ROSIDL = (
    "<buildtool_depend>rosidl_default_generators</buildtool_depend>",
    "<exec_depend>rosidl_default_runtime</exec_depend>",
    "<member_of_group>rosidl_interface_packages</member_of_group>",
)


def interface_package() -> dict[str, str]:
    """Path in the package to text."""
    own = [one for one in vars(chefbot_msgs).values() if isinstance(one, type) and _is_ours(one)]
    actions = [one for one in vars(chefbot_msgs).values() if isinstance(one, Action)]
    files = {f"msg/{one.__name__}.msg": _text(one) for one in own if "_" not in one.__name__}
    for action in actions:
        parts = (_text(one) for one in (action.goal, action.result, action.feedback))
        files[f"action/{action.name}.action"] = "---\n".join(parts)
    used = sorted({package for one in own for package in _packages(one)} - {PACKAGE})
    if actions:
        used = sorted({*used, "action_msgs"})
    papers = manifest(PACKAGE, ABOUT, used, tag="depend", also=ROSIDL)
    return {"package.xml": papers, "CMakeLists.txt": _cmake(used, sorted(files)), **files}


def _is_ours(kind: type) -> bool:
    return issubclass(kind, Message) and kind.__module__ == chefbot_msgs.__name__


def _text(kind: type[Message]) -> str:
    about = "".join(f"# {line}".rstrip() + "\n" for line in inspect.cleandoc(kind.__doc__ or "").splitlines())
    return about + fields_text(kind)


def _packages(kind: type[Message]) -> Iterable[str]:
    """Of all types below it, but for those that rosidl makes of an action."""
    if ros_type(kind).split("/")[1] == "action" and not kind.__name__.endswith(
        ("_Goal", "_Result", "_Feedback")
    ):
        return ()
    return (one.name.partition("/")[0] for one in describe(kind).uses)


def _cmake(depends: Iterable[str], files: Iterable[str]) -> str:
    found = "\n".join(f"find_package({one} REQUIRED)" for one in depends)
    listed = "\n".join(f'  "{one}"' for one in files)
    return f"""cmake_minimum_required(VERSION 3.8)
project({PACKAGE})

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{found}

rosidl_generate_interfaces(${{PROJECT_NAME}}
{listed}
  DEPENDENCIES {" ".join(depends)}
)

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""

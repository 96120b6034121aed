"""How a ROS 2 launch file is written: what it imports, its arguments and its actions.

https://docs.ros.org/en/jazzy/Tutorials/Intermediate/Launch/Launch-Main.html
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

HEAD = '''"""{about}

Written by `chefbot ros2` for the robot {robot}.
"""

'''
IMPORTS = (
    ("pathlib", ("Path",)),
    ("ament_index_python.packages", ("get_package_share_directory",)),
    ("launch", ("LaunchDescription",)),
    ("launch.actions", ("DeclareLaunchArgument", "ExecuteProcess", "IncludeLaunchDescription")),
    ("launch.conditions", ("IfCondition",)),
    ("launch.launch_description_sources", ("PythonLaunchDescriptionSource",)),
    (
        "launch.substitutions",
        ("Command", "EqualsSubstitution", "LaunchConfiguration", "PathJoinSubstitution"),
    ),
    ("launch_ros.actions", ("Node",)),
    ("launch_ros.parameter_descriptions", ("ParameterValue",)),
    ("launch_ros.substitutions", ("FindPackageShare",)),
)
SHARE = 'SHARE = Path(get_package_share_directory("{package}"))\n'
HELPERS = {
    "only": '''

def only(name, value):
    """The condition that an argument has a value."""
    return IfCondition(EqualsSubstitution(LaunchConfiguration(name), value))
''',
    "include": '''

def include(package, file, only_if=None, **arguments):
    """Another package's launch file, or our own; only then must the package be there."""
    path = PathJoinSubstitution([FindPackageShare(package), "launch", file])
    return IncludeLaunchDescription(
        PythonLaunchDescriptionSource(path), launch_arguments=arguments.items(), condition=only_if
    )
''',
    "installed": '''

def installed(package, *path):
    """A file that a package installs, looked for when it is used."""
    return PathJoinSubstitution([FindPackageShare(package), *path])
''',
    "model": '''

def model(robot):
    """The parameter robot_description, from xacro. Command cuts its line at spaces, as a shell does."""
    file = installed("chefbot_description", "urdf", f"{robot}.urdf.xacro")
    return {"robot_description": ParameterValue(Command(["xacro '", file, "'"]), value_type=str)}
''',
    "in_simulation": '''

def in_simulation():
    """Whether time comes from the simulator, for a node's use_sim_time."""
    simulated = EqualsSubstitution(LaunchConfiguration("base"), "simulation")
    return {"use_sim_time": ParameterValue(simulated, value_type=bool)}
''',
    "simulated_time": '''

def simulated_time():
    """use_sim_time for a node, from the argument."""
    return {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
''',
}
BODY = '''

def generate_launch_description():
    """What ros2 launch runs."""
    return LaunchDescription(
        [
'''
TAIL = """\
        ]
    )
"""
MARGIN = " " * 12
WIDTH = 110
INDENTED = 8
"""Columns that an expression may stand further in, within others."""


class Argument(NamedTuple):
    """A launch argument; choices () for any value, default None for one that must be given."""

    about: str
    default: str | None = None
    choices: tuple[str, ...] = ()


class LaunchText(NamedTuple):
    """What a launch file is for, its arguments, and what it starts: expressions of Python."""

    about: str
    arguments: Mapping[str, Argument]
    actions: Sequence[str]


STACK = Argument("whose navigation: our nodes, or Nav2 and slam_toolbox", "chefbot", ("chefbot", "nav2"))
BASE = Argument("our simulator, or the built robot", "simulation", ("simulation", "built"))
ODOMETRY = Argument("ours, or robot_localization", "chefbot", ("chefbot", "ekf"))
WORLD = Argument("hotel, room, empty, or a world file: of our simulator", "hotel")
BOARD_PORT = Argument("the motor board's serial port", "auto")
HEADLESS = Argument("without our page", "false", ("true", "false"))
SIMULATED_TIME = Argument("time from /clock", "true", ("true", "false"))


def robot_argument(robot: str) -> Argument:
    """The robot file for our own nodes."""
    return Argument("a robot of chefbot by name, or its file", robot)


def launch_file(
    package: str, robot: str, about: str, arguments: Mapping[str, Argument], actions: Sequence[str]
) -> str:
    """A whole launch file; every action is a Python expression."""
    lines = [f"{declared(name, argument)},\n" for name, argument in arguments.items()]
    lines += [f"{action.strip()},\n" for action in actions]
    inside = "".join(f"{MARGIN}{line}" for text in lines for line in text.splitlines(keepends=True))
    helpers = _helpers(inside)
    code = "".join([*helpers, BODY + inside + TAIL])
    shared = "\n" + SHARE.format(package=package) if "SHARE" in inside else ""
    return HEAD.format(about=about, robot=robot) + imports(shared + code) + shared + code


def _helpers(inside: str) -> list[str]:
    """Those that the text calls, and those that they call."""
    called: dict[str, str] = {}
    for name, text in reversed(HELPERS.items()):
        if re.search(rf"\b{name}\(", inside + "".join(called.values())):
            called[name] = text
    return list(reversed(called.values()))


def imports(code: str) -> str:
    """What the code uses of what launch files import."""
    words = set(re.findall(r"\w+", code))
    used = [(module, [name for name in names if name in words]) for module, names in IMPORTS]
    lines = [f"from {module} import {', '.join(names)}\n" for module, names in used if names]
    standard = sum(line.startswith("from pathlib") for line in lines)
    return "".join([*lines[:standard], *(["\n"] if standard else []), *lines[standard:]])


def call(name: str, words: Sequence[str]) -> str:
    """A call as an expression: on one line where it fits, else an argument a line."""
    line = f"{name}({', '.join(words)})"
    if len(MARGIN) + INDENTED + len(line) < WIDTH and "\n" not in line:
        return line
    inner = "".join(f"    {line}\n" for word in words for line in f"{word},".splitlines())
    return f"{name}(\n{inner})"


def quoted(text: str) -> str:
    """A string as an expression."""
    return json.dumps(text, ensure_ascii=False)


def listed(items: Sequence[str]) -> str:
    """A list of expressions: on one line where it fits, else an item a line."""
    return call("", items).replace("(", "[", 1)[:-1] + "]"


def declared(name: str, argument: Argument) -> str:
    """The expression that declares an argument."""
    words = [quoted(name)]
    if argument.default is not None:
        words.append(f"default_value={quoted(argument.default)}")
    words.append(f"description={quoted(argument.about)}")
    if argument.choices:
        words.append(f"choices={listed([quoted(one) for one in argument.choices])}")
    return call("DeclareLaunchArgument", words)


def passed(*names: str) -> list[str]:
    """Arguments handed on under their own names."""
    return [f'{name}=LaunchConfiguration("{name}")' for name in names]


def include(package: str, file: str, *words: str) -> str:
    """A launch file within this one."""
    return call("include", [quoted(package), quoted(file), *words])


def ours(launch: str, arguments: Sequence[str], *words: str) -> str:
    """`chefbot launch` as a process; `launch` is an expression, each argument a name handed on."""
    given = [f'["{name}:=", LaunchConfiguration("{name}")]' for name in arguments]
    command = listed(['"chefbot"', '"launch"', launch, *given])
    return call("ExecuteProcess", [f"cmd={command}", 'output="screen"', *words])


def node(package: str, executable: str, *words: str) -> str:
    """A ROS node with further keyword arguments."""
    named = [f"package={quoted(package)}", f"executable={quoted(executable)}", 'output="screen"']
    return call("Node", [*named, *words])

"""The package `chefbot_bringup`: the chapter's launch files, with our nodes or with Nav2 on our base."""

from __future__ import annotations

from chefbot.design.export.ros2.chefbot_launches import chefbot_launches
from chefbot.design.export.ros2.depth_to_scan import depth_to_scan
from chefbot.design.export.ros2.derived_nav_params import Doubt
from chefbot.design.export.ros2.ekf import ekf
from chefbot.design.export.ros2.launch_text import (
    BASE,
    BOARD_PORT,
    HEADLESS,
    ODOMETRY,
    SIMULATED_TIME,
    STACK,
    WORLD,
    Argument,
    LaunchText,
    call,
    include,
    launch_file,
    listed,
    node,
    ours,
    passed,
    quoted,
    robot_argument,
)
from chefbot.design.export.ros2.nav2 import nav2_params
from chefbot.design.export.ros2.package import with_papers
from chefbot.design.export.ros2.rviz import rviz_files
from chefbot.design.export.ros2.slam import slam_toolbox
from chefbot.robot.spec import Robot

PACKAGE = "chefbot_bringup"
DEPENDS = (
    "ament_index_python", "launch", "launch_ros", "chefbot_description", "rviz2",
    "rviz_default_plugins", "nav2_rviz_plugins", "nav2_amcl",
    "nav2_map_server", "nav2_lifecycle_manager", "nav2_controller", "nav2_mppi_controller", "dwb_core",
    "dwb_critics", "dwb_plugins", "nav2_planner", "nav2_navfn_planner", "nav2_smoother", "nav2_behaviors",
    "nav2_velocity_smoother", "nav2_collision_monitor", "nav2_bt_navigator", "nav2_waypoint_follower",
    "nav2_costmap_2d", "slam_toolbox", "robot_localization", "depthimage_to_laserscan", "teleop_twist_keyboard",
)  # fmt: skip
SERVERS = (
    ("nav2_controller", "controller_server", "cmd_vel_controller"),
    ("nav2_smoother", "smoother_server", ""),
    ("nav2_planner", "planner_server", ""),
    ("nav2_behaviors", "behavior_server", "cmd_vel_controller"),
    ("nav2_velocity_smoother", "velocity_smoother", "cmd_vel_controller"),
    ("nav2_collision_monitor", "collision_monitor", ""),
    ("nav2_bt_navigator", "bt_navigator", ""),
    ("nav2_waypoint_follower", "waypoint_follower", ""),
)
"""Package, executable, and what its cmd_vel is called: controller and behaviours -> smoother -> collision monitor."""
BASE_ARGUMENTS = {
    "base": BASE,
    "odometry": ODOMETRY,
    "world": WORLD,
    "board_port": BOARD_PORT,
    "headless": HEADLESS,
}
TIME = {"use_sim_time": SIMULATED_TIME}
MAP = Argument("the map's YAML file", None)
START = {
    f"initial_pose_{name}": Argument(f"where it stands on the map, {name}: metres, radians", "0.0")
    for name in ("x", "y", "a")
}
SIMULATED = "in_simulation()"
SIM_IF_SIMULATION = 'use_sim_time=EqualsSubstitution(LaunchConfiguration("base"), "simulation")'


def bringup_package(robot: Robot, name_or_file: str, doubt: Doubt) -> dict[str, str]:
    """Path in the package to text. `name_or_file` is what our own launches get as robot:=."""
    camera = robot.sensors.depth_camera
    files = {
        **{f"launch/{name}.launch.py": text for name, text in launches(robot, name_or_file).items()},
        **{f"chefbot/{name}": text for name, text in chefbot_launches().items()},
        "config/nav2_params.yaml": nav2_params(robot, doubt),
        "config/slam_toolbox.yaml": slam_toolbox(robot, doubt),
        "config/ekf.yaml": ekf(robot, doubt),
        **({"config/depth_to_scan.yaml": depth_to_scan(camera)} if camera else {}),
        **{f"rviz/{name}": text for name, text in rviz_files(robot, doubt).items()},
    }
    about = f"The robot {robot.name} with its own nodes or with Nav2, written by chefbot from its robot file."
    return with_papers(PACKAGE, about, DEPENDS, files)


def launches(robot: Robot, name_or_file: str) -> dict[str, str]:
    """Launch file's name to its text."""
    machine = {"robot": robot_argument(name_or_file)}
    texts = {
        **_demos({"stack": STACK, **machine, **BASE_ARGUMENTS}),
        **_parts(machine),
        "view_robot": LaunchText("Look at the robot in RViz.", TIME, [_rviz("robot")]),
        "view_navigation": LaunchText(
            "Map, scan, costs, plan and goals in RViz.", TIME, [_rviz("navigation")]
        ),
    }
    if robot.sensors.depth_camera is not None:
        about = "The simulated depth camera and the scan made of it, with nothing that drives."
        texts["3dsensor"] = LaunchText(about, machine, [ours('"3dsensor"', ["robot"])])
    return {name: launch_file(PACKAGE, robot.name, *launch) for name, launch in texts.items()}


def _demos(based: dict[str, Argument]) -> dict[str, LaunchText]:
    """What people start."""
    alone = ("robot", "board_port", "headless", "odometry")
    return {
        "robot_standalone": LaunchText(
            "The built robot's wheels, odometry and sensors.",
            {name: based[name] for name in alone},
            [include(PACKAGE, "base.launch.py", 'base="built"', *passed(*alone))],
        ),
        "gmapping_demo": LaunchText("Map a world while you drive or click goals.", based, mapping_actions()),
        "amcl_demo": LaunchText(
            "Find the way on a saved map.", {"map_file": MAP, **START, **based}, localized_actions()
        ),
        "keyboard_teleop": LaunchText(
            "Drive with the keyboard; wants xterm, or call the program in a terminal of its own.",
            {"stack": STACK},
            teleop_actions(),
        ),
    }


def _parts(machine: dict[str, Argument]) -> dict[str, LaunchText]:
    """What those include."""
    return {
        "base": LaunchText(
            "The base: our simulator or the motor board, its model, and who tells odometry.",
            {**machine, **BASE_ARGUMENTS},
            base_actions(),
        ),
        "navigation": LaunchText("The servers of Nav2.", TIME, navigation_actions()),
        "localization": LaunchText(
            "Nav2's map server and AMCL.", {"map_file": MAP, **START, **TIME}, localization_actions()
        ),
    }


def base_actions() -> list[str]:
    """A process of ours, which also tells the model and its transforms, and the filter if asked for."""
    file = '[str(SHARE / "chefbot"), "/%s_", LaunchConfiguration("odometry"), ".yaml"]'
    return [
        ours(file % "simulation", ["robot", "world", "headless"], 'condition=only("base", "simulation")'),
        ours(file % "built", ["robot", "board_port", "headless"], 'condition=only("base", "built")'),
        ekf_action(SIMULATED),
    ]


def ekf_action(simulated: str) -> str:
    """robot_localization, whose output takes the name of ours."""
    file = f'installed("{PACKAGE}", "config", "ekf.yaml")'
    return node(
        "robot_localization",
        "ekf_node",
        'name="ekf_filter_node"',
        f"parameters={listed([file, simulated])}",
        'remappings=[("odometry/filtered", "odom")]',
        'condition=only("odometry", "ekf")',
    )


def mapping_actions() -> list[str]:
    """Our mapper, or slam_toolbox with Nav2."""
    params = 'slam_params_file=str(SHARE / "config" / "slam_toolbox.yaml")'
    return [
        ours('"gmapping_demo"', ["robot", "world", "headless"], 'condition=only("stack", "chefbot")'),
        include(PACKAGE, "base.launch.py", WITH_NAV2, *passed("robot", *BASE_ARGUMENTS)),
        include("slam_toolbox", "online_async_launch.py", WITH_NAV2, SIM_IF_SIMULATION, params),
        include(PACKAGE, "navigation.launch.py", WITH_NAV2, SIM_IF_SIMULATION),
    ]


def localized_actions() -> list[str]:
    """Our AMCL and navigation, or Nav2's."""
    given = ["robot", "map_file", *START, "world", "headless"]
    return [
        ours('"amcl_demo"', given, 'condition=only("stack", "chefbot")'),
        include(PACKAGE, "base.launch.py", WITH_NAV2, *passed("robot", *BASE_ARGUMENTS)),
        include(PACKAGE, "localization.launch.py", WITH_NAV2, SIM_IF_SIMULATION, *passed("map_file", *START)),
        include(PACKAGE, "navigation.launch.py", WITH_NAV2, SIM_IF_SIMULATION),
    ]


def teleop_actions() -> list[str]:
    """The driver's topic goes before navigation's."""
    terminal = 'prefix="xterm -e"'
    return [
        ours('"keyboard_teleop"', [], terminal, 'condition=only("stack", "chefbot")'),
        node(
            "teleop_twist_keyboard",
            "teleop_twist_keyboard",
            terminal,
            'remappings=[("cmd_vel", "cmd_vel_teleop")]',
            'condition=only("stack", "nav2")',
        ),
    ]


def navigation_actions() -> list[str]:
    """Each server with the one file of parameters, and who starts them in order."""
    nodes = [
        node(
            package,
            executable,
            f'name="{executable}"',
            f"parameters={listed(PARAMS)}",
            *([f'remappings=[("cmd_vel", "{topic}")]'] if topic else []),
        )
        for package, executable, topic in SERVERS
    ]
    return [*nodes, _lifecycle("navigation", [executable for _, executable, _ in SERVERS])]


def localization_actions() -> list[str]:
    """The map, and AMCL that starts at the pose given."""
    start = [
        f'{{"initial_pose.{field}": ParameterValue(LaunchConfiguration("initial_pose_{name}"), value_type=float)}}'
        for field, name in (("x", "x"), ("y", "y"), ("yaw", "a"))
    ]
    file = '{"yaml_filename": ParameterValue(LaunchConfiguration("map_file"), value_type=str)}'
    amcl = listed([*PARAMS, '{"set_initial_pose": True}', *start])
    return [
        node(
            "nav2_map_server", "map_server", 'name="map_server"', f"parameters={listed([file, PARAMS[-1]])}"
        ),
        node("nav2_amcl", "amcl", 'name="amcl"', f"parameters={amcl}"),
        _lifecycle("localization", ["map_server", "amcl"]),
    ]


PARAMS = ('str(SHARE / "config" / "nav2_params.yaml")', "simulated_time()")
WITH_NAV2 = 'only_if=only("stack", "nav2")'


def _lifecycle(name: str, nodes: list[str]) -> str:
    names = call("dict", [f"node_names={listed([quoted(one) for one in nodes])}"])
    params = listed(['{"autostart": True}', names, PARAMS[-1]])
    return node(
        "nav2_lifecycle_manager",
        "lifecycle_manager",
        f'name="lifecycle_manager_{name}"',
        f"parameters={params}",
    )


def _rviz(name: str) -> str:
    file = f'arguments=["-d", str(SHARE / "rviz" / "{name}.rviz")]'
    return node("rviz2", "rviz2", file, f"parameters=[{PARAMS[-1]}]")

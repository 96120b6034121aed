"""Arguments and options that several commands share."""

from __future__ import annotations

import typer

from chefbot.cli import completion

ROBOTS = "chefbot, chefbot_cliff, chefbot_lidar, desk, jackal, porter, or a robot file"
WORLDS = "hotel, room, workshop, empty, a world file, or any ROS map.yaml"
START = typer.Option(
    help="start pose '\\[x, y, yaw]', m and rad; default: the world's; on a map, where clearance is largest"
)
UNKNOWN = typer.Option(
    help="what unknown cells of a map are: wall, free, or auto: walls if large or at the map's edge",
    autocompletion=completion.unknown_cells,
)
WEB_UI = "http://127.0.0.1:8080"
ROBOT_ARGUMENT = typer.Argument(help=ROBOTS, autocompletion=completion.robots)
ROBOT_OPTION = typer.Option(help=ROBOTS, autocompletion=completion.robots)
OUT_FILE = typer.Option(help="output file; default: standard output")
PAGE = typer.Option(help="address of the running robot's web UI")
LAN = typer.Option(
    "--lan", help="serve the web UI to phones in this network; prints its address as a QR code"
)
JOIN = typer.Option(help="Zenoh endpoint of another machine, tls/HOST; repeatable")
AS_JSON = typer.Option("--json", help="print the result as JSON, in SI units")
KEY_VALUES = typer.Argument(
    help="arguments of the launch, key:=value ...", autocompletion=completion.launch_arguments
)

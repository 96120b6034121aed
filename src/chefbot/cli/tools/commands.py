"""The groups of the ROS graph tools, and `chefbot topic bridge`."""

from __future__ import annotations

from typing import Annotated

import typer

from chefbot.cli.command_group import HELP_OPTIONS, CommandGroup
from chefbot.ros2.tools.apps import action_app, bag_app, graph, node_app, param_app, service_app, topic_app

__all__ = ["TOOLS", "graph"]

TOOLS = {
    "topic": topic_app,
    "node": node_app,
    "service": service_app,
    "action": action_app,
    "param": param_app,
    "bag": bag_app,
}
for tool_app in TOOLS.values():
    tool_app.info.cls = CommandGroup
    tool_app.info.context_settings = HELP_OPTIONS
topic_app.info.help = "Topics: list, info, echo, measure rates, publish, bridge to DDS."


@topic_app.command("bridge")
def bridge(
    domain: Annotated[int | None, typer.Option(help="DDS domain; default: ROS_DOMAIN_ID, else 0")] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(help="bridge only this topic, such as /scan or '/robot1/*'; repeatable"),
    ] = None,
    interface: Annotated[
        str, typer.Option(help="network interface: lo, eth0, ...; auto: Cyclone DDS selects one")
    ] = "",
) -> None:
    """Bridge topics both ways to ROS 2 systems that use DDS, the default; needs the extra `dds`."""
    from chefbot.cli.tools.dds_bridge import run_dds

    run_dds(domain, topics or [], interface)

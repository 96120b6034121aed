"""The commands of the ROS graph tools: `topic`, `node`, `service`, `action`, `param` and `bag`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli.command_group import new_group

topic_app = new_group("Topics: list, info, echo, measure rates, publish, bridge to DDS.")
node_app = new_group("Nodes of the ROS graph, chefbot's and ROS 2's.")
service_app = new_group("Services: list, call.")
action_app = new_group("Actions: list, send a goal.")
param_app = new_group("Parameters of running nodes.")
bag_app = new_group("Bags in rosbag2's format: record, play, info.")
TOOLS = {
    "topic": topic_app,
    "node": node_app,
    "service": service_app,
    "action": action_app,
    "param": param_app,
    "bag": bag_app,
}
_TOPIC = typer.Argument(help="topic name, such as /scan")
_NODE = typer.Argument(help="node name, such as /base")
_PARAMETER = typer.Argument(help="parameter name, such as teleop_hold")
_VALUES = typer.Argument(
    help="[TYPE] VALUES: the type, if needed, and the fields as YAML or JSON in quotes; others get their defaults"
)
_VERBOSE = typer.Option("-v", "--verbose", help="show types and endpoints as well")
_ALL = typer.Option("--all", help="include hidden names: action internals and tools")
_SECONDS = typer.Option(min=0, help="duration, s; 0: until Ctrl-C")


@topic_app.command("list")
def topic_list(
    verbose: Annotated[bool, _VERBOSE] = False, include_hidden: Annotated[bool, _ALL] = False
) -> None:
    """List the topics that have a publisher or a subscription."""
    from chefbot.ros2.tools.topic_info import run_list

    run_list(verbose, include_hidden)


@topic_app.command("info")
def topic_info(topic: Annotated[str, _TOPIC]) -> None:
    """Show the publishers and subscriptions of a topic with their QoS, and which of them do not match."""
    from chefbot.ros2.tools.topic_info import run_info

    run_info(topic)


@topic_app.command("echo")
def topic_echo(
    topic: Annotated[str, _TOPIC],
    once: Annotated[bool, typer.Option("--once", help="print one message, then stop")] = False,
    field: Annotated[
        str, typer.Option(help="the only field to print, such as pose.pose.position or ranges[0]")
    ] = "",
    full_length: Annotated[bool, typer.Option("--full-length", help="print arrays in full length")] = False,
    duration: Annotated[float, _SECONDS] = 0.0,
) -> None:
    """Print the messages of a topic as YAML."""
    from chefbot.ros2.tools.topic_echo import run_echo

    raise typer.Exit(run_echo(topic, once, field, full_length, duration))


@topic_app.command("hz")
def topic_hz(topic: Annotated[str, _TOPIC], duration: Annotated[float, _SECONDS] = 5.0) -> None:
    """Measure the rate, jitter and bandwidth of a topic."""
    from chefbot.ros2.tools.topic_echo import run_hz

    raise typer.Exit(run_hz(topic, duration))


@topic_app.command("pub")
def topic_pub(
    topic: Annotated[str, _TOPIC],
    values: Annotated[list[str], _VALUES],
    rate: Annotated[float, typer.Option(min=0.01, max=1000, help="publishing rate, Hz")] = 1.0,
    once: Annotated[bool, typer.Option("--once", help="publish one message, then stop")] = False,
) -> None:
    """Publish messages until Ctrl-C; times may be written as now, headers as auto."""
    from chefbot.ros2.tools.topic_pub import run_pub

    run_pub(topic, values, rate, once)


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


@node_app.command("list")
def node_list(include_hidden: Annotated[bool, _ALL] = False) -> None:
    """List the names of all nodes."""
    from chefbot.ros2.tools.node import run_list

    run_list(include_hidden)


@node_app.command("info")
def node_info(node: Annotated[str, _NODE]) -> None:
    """Show what a node publishes, subscribes to, serves and calls."""
    from chefbot.ros2.tools.node import run_info

    run_info(node)


@service_app.command("list")
def service_list(
    verbose: Annotated[bool, _VERBOSE] = False, include_hidden: Annotated[bool, _ALL] = False
) -> None:
    """List the services that have a server."""
    from chefbot.ros2.tools.service import run_list

    run_list(verbose, include_hidden)


@service_app.command("call")
def service_call(
    name: Annotated[str, typer.Argument(help="service name, such as /base/get_parameters")],
    values: Annotated[list[str] | None, _VALUES] = None,
    timeout: Annotated[float, typer.Option(min=0.1, max=3600, help="timeout of the response, s")] = 5.0,
) -> None:
    """Call a service and print the response."""
    from chefbot.ros2.tools.service import run_call

    run_call(name, values or [], timeout)


@action_app.command("list")
def action_list(verbose: Annotated[bool, _VERBOSE] = False) -> None:
    """List the actions that have a server."""
    from chefbot.ros2.tools.action import run_list

    run_list(verbose)


@action_app.command("send")
def action_send(
    name: Annotated[str, typer.Argument(help="action name, such as /navigate_to_pose")],
    values: Annotated[list[str] | None, _VALUES] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="print no feedback")] = False,
) -> None:
    """Send a goal and wait for its result; Ctrl-C cancels it. Exit code 1 unless it succeeded."""
    from chefbot.ros2.tools.action import run_send

    raise typer.Exit(run_send(name, values or [], quiet))


@param_app.command("list")
def param_list(node: Annotated[str, typer.Argument(help="node name; default: all nodes")] = "") -> None:
    """List parameters and their values."""
    from chefbot.ros2.tools.param import run_list

    run_list(node)


@param_app.command("get")
def param_get(node: Annotated[str, _NODE], parameter: Annotated[str, _PARAMETER]) -> None:
    """Print the value of a parameter."""
    from chefbot.ros2.tools.param import run_get

    run_get(node, parameter)


@param_app.command("set")
def param_set(
    node: Annotated[str, _NODE],
    parameter: Annotated[str, _PARAMETER],
    value: Annotated[str, typer.Argument(help="new value as YAML: 0.3, true, text, [1, 2]")],
) -> None:
    """Set a parameter; exit code 1 if the node rejects the value."""
    from chefbot.ros2.tools.param import run_set

    raise typer.Exit(run_set(node, parameter, value))


@param_app.command("describe")
def param_describe(node: Annotated[str, _NODE], parameter: Annotated[str, _PARAMETER]) -> None:
    """Show a parameter's description, type and bounds."""
    from chefbot.ros2.tools.param import run_describe

    run_describe(node, parameter)


@node_app.command("graph")
def node_graph(
    out: Annotated[
        Path, typer.Option(help="output file: .svg, .png or .pdf for a picture, .dot for text")
    ] = Path("runs/graph.svg"),
    as_json: Annotated[
        bool, typer.Option("--json", help="print the graph as JSON, without a picture")
    ] = False,
    duration: Annotated[float, typer.Option(min=0, help="duration for which rates are measured, s")] = 3.0,
) -> None:
    """Draw nodes, topics and measured rates with Graphviz."""
    from chefbot.ros2.tools.graph import run_graph

    run_graph(out, as_json, duration)


@bag_app.command("record")
def bag_record(
    topics: Annotated[list[str] | None, typer.Argument(help="topics to record; default: all")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", help="new folder or file NAME.mcap of the bag; default: a folder named by the time"
        ),
    ] = None,
    include_hidden: Annotated[bool, _ALL] = False,
    duration: Annotated[float, _SECONDS] = 0.0,
) -> None:
    """Record topics of any type into a bag."""
    from chefbot.ros2.tools.bag import run_record

    run_record(out, topics or [], include_hidden, duration)


@bag_app.command("play")
def bag_play(
    bag: Annotated[Path, typer.Argument(help="a bag's folder, or an MCAP file")],
    rate: Annotated[
        float, typer.Option(min=0.01, max=1000, help="playback rate relative to the recording")
    ] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="repeat until Ctrl-C")] = False,
    topics: Annotated[list[str] | None, typer.Option(help="play only this topic; repeatable")] = None,
    clock: Annotated[bool, typer.Option("--clock", help="publish the recorded time on /clock")] = False,
) -> None:
    """Publish the messages of a bag."""
    from chefbot.ros2.tools.bag import run_play

    run_play(bag, rate, loop, topics or [], clock)


@bag_app.command("info")
def bag_info(bag: Annotated[Path, typer.Argument(help="a bag's folder, or an MCAP file")]) -> None:
    """Show the contents of a bag; exit code 1 if it is truncated."""
    from chefbot.ros2.tools.bag import run_info

    raise typer.Exit(run_info(bag))

"""Names for the completion of the shell; what they need is imported only when the shell asks for it."""

from __future__ import annotations

from typing import Any, get_args


def launches(incomplete: str) -> list[tuple[str, str]]:
    """Return the built-in launches that begin with the text, each with its description."""
    from chefbot.runtime.launch import built_in_launches, load_launch

    names = [name for name in built_in_launches() if name.startswith(incomplete)]
    described = [(name, load_launch(name).description) for name in names]
    return [(name, about) for name, about in described if about]


def launch_arguments(ctx: Any, incomplete: str) -> list[str]:
    """Return the arguments `key:=` of the launch on the command line."""
    from chefbot.runtime.launch import load_launch

    name = ctx.params.get("name")
    keys = load_launch(name).args if name else {}
    return [f"{key}:=" for key in keys if key.startswith(incomplete)]


def robots(incomplete: str) -> list[str]:
    """Return the built-in robots that begin with the text."""
    from chefbot.robot.load import built_in_robots

    return [name for name in built_in_robots() if name.startswith(incomplete)]


def worlds(incomplete: str) -> list[str]:
    """Return the built-in worlds that begin with the text."""
    from chefbot.sim.world.world import built_in_worlds

    return [name for name in built_in_worlds() if name.startswith(incomplete)]


def building_kinds(incomplete: str) -> list[str]:
    """Return the kinds of generated buildings that begin with the text."""
    from chefbot.buildings.parameters import KINDS

    return [name for name in KINDS if name.startswith(incomplete)]


def unknown_cells(incomplete: str) -> list[str]:
    """Return what unknown cells of a map can be that begins with the text."""
    from chefbot.sim.world.map_world import UnknownCells

    return [name for name in get_args(UnknownCells) if name.startswith(incomplete)]


def serial_ports(incomplete: str) -> list[tuple[str, str]]:
    """Return the serial ports of this computer, each with its description."""
    from chefbot.devices.serial_ports import ports

    return [(port.path, port.description) for port in ports() if port.path.startswith(incomplete)]


def scenarios(incomplete: str) -> list[str]:
    """Return the built-in scenarios that begin with the text."""
    from chefbot.proving.scenario import built_in_scenarios

    return [name for name in built_in_scenarios() if name.startswith(incomplete)]

"""The generated reference holds every launch, node, parameter, topic, action, verb and package."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import typer.main

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))

from generate.__main__ import write_all  # noqa: E402
from generate.api import SOURCE  # noqa: E402
from generate.data_flow import column_order, draw, flows_of  # noqa: E402
from generate.launches import node_kinds, parameters_of, ports_of  # noqa: E402
from generate.links import rewrite_links  # noqa: E402
from generate.rst import docstring, escape  # noqa: E402

from chefbot.cli.app import app  # noqa: E402
from chefbot.nodes.controller import ControllerNode  # noqa: E402
from chefbot.runtime.launch import STANDARD_ARGS, built_in_launches, load_launch  # noqa: E402
from chefbot.runtime.node import params_type  # noqa: E402
from chefbot.sim.faults.events import KINDS as FAULT_KINDS  # noqa: E402


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reference")
    write_all(folder)
    return folder


@pytest.mark.slow
def test_every_launch_stands_there_with_its_arguments(pages: Path) -> None:
    common, *sections = (pages / "launches.rst").read_text().split(".. _launch-")
    by_name = {section.partition(":")[0]: section for section in sections}
    assert by_name.keys() == built_in_launches().keys()
    for name, section in by_name.items():
        launch = load_launch(name)
        assert all(f"``{key}``" in (common if key in STANDARD_ARGS else section) for key in launch.args)
        assert all(f"``{node}``" in section for node in launch.nodes)


def test_every_parameter_has_description_default_and_bounds(pages: Path) -> None:
    text = (pages / "nodes.rst").read_text()
    for kind in node_kinds().values():
        for parameter in parameters_of(params_type(kind)):
            assert f"``{parameter.name}``" in text
            assert parameter.description, (kind, parameter.name)
            assert parameter.bounds or parameter.type not in ("int", "float"), (kind, parameter.name)


def test_every_fault_has_its_keys_with_descriptions(pages: Path) -> None:
    text = (pages / "faults.rst").read_text()
    for kind in FAULT_KINDS:
        assert f"``{kind.__struct_config__.tag}``" in text
        assert all(key.description and f"``{key.name}``" in text for key in parameters_of(kind)), kind


def test_units_come_from_the_descriptions() -> None:
    units = {p.name: p.unit for p in parameters_of(params_type(ControllerNode))}
    assert units["dwa.period" if "dwa.period" in units else "settings.period"] == "s"


def test_ports_hold_topics_and_actions() -> None:
    ports = {(port.role, port.name, port.type) for port in ports_of(ControllerNode)}
    assert ("subscription", "scan", "sensor_msgs/msg/LaserScan") in ports
    assert ("action server", "follow_path", "nav2_msgs/action/FollowPath") in ports


def test_every_verb_stands_there(pages: Path) -> None:
    text = (pages / "command_line.rst").read_text()
    group = typer.main.get_command(app)
    for name, verb in group.commands.items():  # type: ignore[attr-defined]
        if not verb.hidden:
            for command in [name, *(f"{name} {inner}" for inner in getattr(verb, "commands", {}))]:
                assert f"chefbot {escape(command)}\n" in text


def test_every_package_has_a_page(pages: Path) -> None:
    folders = {path.parent for path in (SOURCE / "chefbot").rglob("*.py")}
    for folder in folders:
        assert (pages / "api" / f"{'.'.join(folder.relative_to(SOURCE).parts)}.rst").exists()
    assert "py:method:: update(" in (pages / "api" / "chefbot.slam.rst").read_text()


def test_the_figure_shows_every_flow_of_the_launch() -> None:
    picture = DOCS / "pictures" / "data_flow.svg"
    hint = "in docs: python -m generate.data_flow amcl_demo pictures/data_flow.svg"
    assert picture.read_text() == draw("amcl_demo"), hint
    figure = ElementTree.parse(picture)
    texts = {
        "".join(element.itertext()).split(" ")[0]
        for element in figure.iter("{http://www.w3.org/2000/svg}text")
    }
    nodes, flows = flows_of("amcl_demo")
    assert {flow.name for flow in flows} | set(nodes) <= texts
    assert {"scan", "odom", "cmd_vel_nav", "wheel_speeds"} <= {flow.name for flow in flows}


def test_columns_follow_the_flow() -> None:
    nodes, flows = flows_of("amcl_demo")
    order = column_order(nodes, flows)
    assert sorted(order) == sorted(nodes)
    assert order.index("simulator") < order.index("odometry") and order[-1] == "page"


def test_docstrings_become_paragraphs_lists_and_code() -> None:
    text = docstring("Return `x` of *args.\nMore.\n\n    code(x)\n\n- one\n  more\n- two")
    assert re.split(r"\n\n", text.strip()) == [
        "Return \\ ``x``\\  of \\*args. More.",
        ".. code-block:: text",
        "   code(x)",
        "* one more\n* two",
    ]


def test_links_lead_into_the_site_or_to_the_repository() -> None:
    def link(target: str, page: str) -> str:
        return rewrite_links(f"[a]({target})", DOCS / f"{page}.md", page)[4:-1]

    assert link("wire.md#tls", "tools") == "wire.md#tls"
    assert link("../firmware/README.md#wiring", "chapter") == "firmware.md#wiring"
    assert link("../../README.md", "learn/01_robot") == "../readme.md"
    assert link("../src/chefbot/config.py", "tools").startswith("https://github.com/")
    assert link("https://zenoh.io", "wire") == "https://zenoh.io"

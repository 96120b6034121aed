"""Nodes of a launch that are part of it for some values of an argument only."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.runtime.launch import load_launch

OWN = """
args: {mapper: graph, loud: true}
nodes:
  a: {kind: "x:A", when: {mapper: gmapping}}
  b: {kind: "x:B", when: {mapper: graph, loud: true}}
  c: {kind: "x:C"}
"""


def own(folder: Path, text: str = OWN) -> str:
    (folder / "own.yaml").write_text(text)
    return str(folder / "own.yaml")


@pytest.mark.parametrize("launch", ["gmapping_demo", "explore", "several_machines"])
def test_each_mapping_launch_has_the_mapper_that_is_chosen(launch: str) -> None:
    for mapper, node, other in (("gmapping", "gmapping", "graph_slam"), ("graph", "graph_slam", "gmapping")):
        nodes = load_launch(launch, {"mapper": mapper}).nodes
        assert node in nodes and other not in nodes and "map_recorder" in nodes
    assert "gmapping" in load_launch(launch).nodes


def test_all_conditions_of_a_node_have_to_hold(tmp_path: Path) -> None:
    path = own(tmp_path)
    assert list(load_launch(path).nodes) == ["b", "c"]
    assert list(load_launch(path, {"mapper": "gmapping"}).nodes) == ["a", "c"]
    assert list(load_launch(path, {"loud": "false"}).nodes) == ["c"]
    assert list(load_launch(path, {"mapper": ""}).nodes) == ["c"]


def test_a_value_that_no_node_is_for_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="mapper:=grpah must be one of gmapping, graph"):
        load_launch("gmapping_demo", {"mapper": "grpah"})
    unknown = OWN.replace("args: {mapper: graph, loud", "args: {mappr: graph, loud")
    with pytest.raises(UserError, match=r"there is no argument 'mapper'.*did you mean 'mappr'"):
        load_launch(own(tmp_path, unknown))

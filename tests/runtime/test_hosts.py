"""One launch file for several machines: each node runs on exactly one of them, and wrong names are named."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.errors import ChefbotError, UserError
from chefbot.runtime.hosts import check_host, hosts_of, part_for_machine
from chefbot.runtime.launch import Launch, NodeEntry, load_launch

HOSTS = ("", "nuc", "laptop")


@given(st.dictionaries(st.sampled_from("abcdef"), st.sampled_from(HOSTS), max_size=6))
def test_each_node_runs_on_exactly_one_machine(homes: dict[str, str]) -> None:
    nodes = {name: NodeEntry(kind="a:B", host=host) for name, host in homes.items()}
    launch = Launch(name="x", description="", args={}, nodes=nodes)
    parts = {machine: part_for_machine(launch, machine) for machine in ("robot1", "nuc", "laptop")}
    known = set(hosts_of(launch)) | {"robot1"}
    run = [name for machine, part in parts.items() if machine in known for name in part.nodes]
    assert sorted(run) == sorted(homes)
    for machine in hosts_of(launch):
        assert parts[machine].clock == "robot"
    assert parts["robot1"].clock == "simulation"


def test_unknown_machines_are_named() -> None:
    launch = load_launch("several_machines", {"slam": "nuc", "screen": "laptop"})
    check_host(launch, "nuc", "nuc", may_be_robot=False)
    check_host(launch, "", "laptop", may_be_robot=False)
    check_host(launch, "", "robot1", may_be_robot=True)
    with pytest.raises(UserError, match=r"nothing runs on host 'nucc'.*did you mean 'nuc'"):
        check_host(launch, "nucc", "nucc", may_be_robot=True)
    with pytest.raises(UserError, match=r"alice is not a robot.*laptop, nuc"):
        check_host(launch, "", "alice", may_be_robot=False)
    with pytest.raises(UserError, match="none of its nodes has `host:`"):
        check_host(load_launch("explore"), "nuc", "nuc", may_be_robot=True)


def write(folder: Path, text: str) -> str:
    path = folder / "own.yaml"
    path.write_text(text)
    return str(path)


def test_an_entry_without_a_kind_changes_an_included_one(tmp_path: Path) -> None:
    own = """
include: [simulator]
nodes:
  simulator: {host: server, params: {picture_hz: 1.0}, remap: {scan: scan_raw}}
  page: {disabled: true}
"""
    before = load_launch("simulator").nodes["simulator"]
    nodes = load_launch(write(tmp_path, own)).nodes
    assert list(nodes) == ["simulator"]
    assert load_launch("several_machines", {"headless": "true"}).nodes.keys().isdisjoint({"page"})
    changed = nodes["simulator"]
    assert (changed.kind, changed.host, changed.remap) == (before.kind, "server", {"scan": "scan_raw"})
    assert changed.params == {**before.params, "picture_hz": 1.0}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("include: [simulator]\nnodes: {simulatr: {host: nuc}}", "did you mean 'simulator'"),
        ("nodes: {a: {host: nuc}}", "node a has no kind"),
        ("nodes: {a: {kind: 'x:Y', host: 'my nuc'}}", "host"),
        ("nodes: {a: {kind: 'x:Y', hots: nuc}}", "did you mean 'host'"),
    ],
)
def test_invalid_host_entries_are_reported_in_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match=sentence):
        load_launch(write(tmp_path, text))

"""The XML of behavior trees: trees in the style of Nav2 are read, and what cannot run is refused in a sentence."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from py_trees.common import Status
from tests.support.fake_navigation import RecordedNavigation, no_path, path_found

from chefbot.behavior_tree.blackboard import BehaviorTreeError
from chefbot.behavior_tree.bt_xml import MAX_NODES, build_tree, read_tree_file, write_tree
from chefbot.behavior_tree.catalog import CONTROL_NODES
from chefbot.behavior_tree.navigation_nodes import navigation_nodes
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import FollowPath_Result

NAV2_STYLE = """<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <RecoveryNode number_of_retries="6" name="Navigate">
      <PipelineSequence name="Drive">
        <ControllerSelector selected_controller="{controller}" default_controller="FollowPath" topic_name="c"/>
        <PlannerSelector selected_planner="{planner}" default_planner="GridBased" topic_name="p"/>
        <RateController hz="1.0">
          <RecoveryNode number_of_retries="1" name="Plan">
            <ComputePathToPose goal="{goal}" path="{path}" planner_id="{planner}" error_code_id="{plan_error}"/>
            <Sequence>
              <WouldAPlannerRecoveryHelp error_code="{plan_error}"/>
              <ClearEntireCostmap name="ClearGlobal" service_name="global_costmap/clear_entirely_global_costmap"/>
            </Sequence>
          </RecoveryNode>
        </RateController>
        <RecoveryNode number_of_retries="1" name="Follow">
          <FollowPath path="{path}" controller_id="{controller}" error_code_id="{follow_error}"/>
          <Sequence>
            <WouldAControllerRecoveryHelp error_code="{follow_error}"/>
            <ClearEntireCostmap name="ClearLocal" service_name="local_costmap/clear_entirely_local_costmap"/>
          </Sequence>
        </RecoveryNode>
      </PipelineSequence>
      <ReactiveFallback>
        <GoalUpdated/>
        <RoundRobin>
          <Spin spin_dist="1.57"/>
          <Wait wait_duration="5.0"/>
          <BackUp backup_dist="0.30" backup_speed="0.15"/>
        </RoundRobin>
      </ReactiveFallback>
    </RecoveryNode>
  </BehaviorTree>
  <TreeNodesModel/>
</root>"""


def built(text: str, services: RecordedNavigation | None = None) -> BehaviorTree:
    catalog = {**CONTROL_NODES, **navigation_nodes(services or RecordedNavigation())}
    tree = build_tree(read_tree_file(text.encode(), "t.xml"), catalog)
    tree.blackboard.set("goal", PoseStamped())
    return tree


def body(inside: str) -> str:
    return f'<root BTCPP_format="4"><BehaviorTree ID="T">{inside}</BehaviorTree></root>'


def test_a_tree_in_the_style_of_nav2_plans_follows_and_recovers() -> None:
    services = RecordedNavigation()
    tree = built(NAV2_STYLE, services)
    tree.tick(0)
    services.begun[-1].end(no_path())
    tree.tick(100_000_000)
    assert services.names() == ["plan", "clear 1000"]
    services.begun[-1].end()
    tree.tick(200_000_000)
    services.begun[-1].end(path_found())
    tree.tick(300_000_000)
    assert services.names()[2:] == ["plan", "follow"]
    services.begun[-1].end(FollowPath_Result())
    assert tree.tick(400_000_000) is Status.SUCCESS


def test_both_forms_of_an_element_mean_the_same() -> None:
    short = built(body('<Sequence name="s"><Inverter><Wait wait_duration="1"/></Inverter></Sequence>'))
    long = built(
        body(
            '<Control ID="Sequence" name="s"><Decorator ID="Inverter"><Action ID="Wait" wait_duration="1"/>'
            "</Decorator></Control>"
        )
    )
    assert short.states() == long.states()


def test_a_written_tree_is_equal_and_has_a_model_for_groot() -> None:
    catalog = {**CONTROL_NODES, **navigation_nodes(RecordedNavigation())}
    tree = built(NAV2_STYLE)
    data = write_tree(tree, catalog)
    again = build_tree(read_tree_file(data, "again.xml"), catalog)
    assert again.states() == tree.states() and write_tree(again, catalog) == data
    models = {
        element.get("ID") for element in ET.fromstring(data).iter() if element.tag in ("Action", "Control")
    }
    assert {"ComputePathToPose", "RecoveryNode"} <= models


def test_a_subtree_has_keys_of_its_own_but_those_it_is_given() -> None:
    services = RecordedNavigation(lambda pending: pending.end())
    text = """<root BTCPP_format="4" main_tree_to_execute="Main">
      <BehaviorTree ID="Main"><Sequence><SubTree ID="Part" distance="{far}" time="3"/></Sequence></BehaviorTree>
      <BehaviorTree ID="Part"><Sequence><Spin spin_dist="{distance}"/><Wait wait_duration="{time}"/></Sequence>
      </BehaviorTree></root>"""
    tree = built(text, services)
    tree.blackboard.set("far", 0.5)
    assert tree.tick(0) is Status.SUCCESS
    assert services.names() == ["spin 0.5", "wait 3"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("<root>", "is not valid XML"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><root BTCPP_format="4"/>', "has a DOCTYPE"),
        ("<tree/>", "its outermost element is <tree>, not <root>"),
        ("<root/>", "BTCPP_format=None"),
        ('<root BTCPP_format="3"/>', "BTCPP_format='3'"),
        ('<root BTCPP_format="4"/>', "has no <BehaviorTree>"),
        (
            '<root BTCPP_format="4"><include path="/etc/passwd"/></root>',
            "<include> in <root> is not supported",
        ),
        ('<root BTCPP_format="4"><BehaviorTree/></root>', "<BehaviorTree> lacks the attribute ID"),
        (
            '<root BTCPP_format="4"><BehaviorTree ID="A"><Wait/></BehaviorTree><BehaviorTree ID="B"/></root>',
            "lacks main_tree_to_execute",
        ),
        (
            '<root BTCPP_format="4" main_tree_to_execute="Mian"><BehaviorTree ID="Main"/></root>',
            "did you mean 'Main'",
        ),
        (
            '<root BTCPP_format="4"><BehaviorTree ID="A"/><BehaviorTree ID="A"/></root>',
            "two trees have the ID 'A'",
        ),
        (body(""), "has 0 roots"),
        (body("<Wait/><Wait/>"), "has 2 roots"),
        (body("<Sequnce><Wait/></Sequnce>"), "the node 'Sequnce' is unknown (did you mean 'Sequence'?)"),
        (body('<Action ID="Sequence"/>'), "the Action node 'Sequence' is unknown"),
        (body("<Action/>"), "<Action> lacks the attribute ID"),
        (body('<Wait wait_duraton="1"/>'), "did you mean 'wait_duration'"),
        (body('<Wait _skipIf="x"/>'), "the attribute '_skipIf' is unknown"),
        (body('<Wait wait_duration="soon"/>'), "wait_duration is 'soon'; it must be a number of at least 0"),
        (body('<Wait wait_duration="nan"/>'), "it must be a number"),
        (body('<Wait wait_duration="-1"/>'), "it must be a number of at least 0"),
        (body("<FollowPath/>"), "the attribute path is missing"),
        (body('<FollowPath path="straight"/>'), "it must be a blackboard key"),
        (body('<Wait error_code_id="code"/>'), "an output must be a blackboard key"),
        (body("<Sequence/>"), "has 0 children; it needs 1 or more"),
        (body("<RecoveryNode><Wait/></RecoveryNode>"), "has 1 children; it needs 2"),
        (body("<Inverter><Wait/><Wait/></Inverter>"), "has 2 children; it needs 1"),
        (body("<Wait><Wait/></Wait>"), "has 1 children; it needs 0"),
        (body('<SubTree ID="T"/>'), "the tree 'T' contains itself"),
        (body('<SubTree ID="U"/>'), "there is no tree with the ID 'U'"),
        (body('<SubTree ID="T" _onSuccess="x"/>'), "_onSuccess is not supported"),
    ],
)
def test_what_cannot_run_is_refused_in_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(BehaviorTreeError, match=re.escape(sentence)) as error:
        built(text)
    assert str(error.value).startswith("t.xml") and "\n" not in str(error.value)


def test_subtrees_that_multiply_are_refused() -> None:
    ten = [10 * f'<SubTree ID="T{k + 1}"/>' for k in range(8)]
    trees = [f'<BehaviorTree ID="T{k}"><Sequence>{ten[k]}</Sequence></BehaviorTree>' for k in range(8)]
    last = '<BehaviorTree ID="T8"><Wait/></BehaviorTree>'
    text = f'<root BTCPP_format="4" main_tree_to_execute="T0">{"".join(trees)}{last}</root>'
    with pytest.raises(BehaviorTreeError, match=f"has more than {MAX_NODES} nodes"):
        built(text)


def test_a_key_that_nobody_has_written_is_named() -> None:
    tree = built(body('<Wait wait_duration="{tme}"/>'))
    with pytest.raises(BehaviorTreeError, match="the blackboard has no 'tme'"):
        tree.tick(0)


@given(st.data())
def test_damaged_files_are_read_or_refused(data: st.DataObject) -> None:
    text = bytearray(NAV2_STYLE.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        cut = data.draw(st.integers(0, 40))
        text[at : at + cut] = data.draw(st.binary(max_size=8))
        if not text:
            break
    try:
        catalog = {**CONTROL_NODES, **navigation_nodes(RecordedNavigation())}
        build_tree(read_tree_file(bytes(text), "t.xml"), catalog)
    except BehaviorTreeError as error:
        assert str(error).startswith("t.xml")

"""Tests that joint states and transforms of the wheels agree with the URDF and the encoder counts."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.rotations import matrix

from chefbot.design.export.urdf import urdf
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import JointState
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.joint_states import PERIOD_NS
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry, load_launch
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

ROBOTS = {name: load_robot(name) for name in sorted(built_in_robots())}
TICK_NS = 20_000_000


class PublishedStates:
    """The messages for given encoder counts, one pair every 20 ms."""

    def __init__(self, robot: Robot, ticks: list[tuple[int, int]], silence: float = 0.0) -> None:
        loop = Loop(StepClock())
        system = NodeContainer(loop, robot, 1)
        kinds = {
            "joint_state_publisher": "joint_states:JointStatesNode",
            "robot_state_publisher": "robot_state_publisher:RobotStatePublisherNode",
        }
        nodes = {name: NodeEntry(kind=f"chefbot.nodes.{kind}") for name, kind in kinds.items()}
        self.joints: list[JointState] = []
        self.frames: list[TFMessage] = []
        self.fixed: list[TFMessage] = []
        for topic, messages in (
            ("joint_states", self.joints),
            ("tf", self.frames),
            ("tf_static", self.fixed),
        ):
            loop.subscribe(topic, "test", messages.append)  # type: ignore[arg-type]
        system.launch(Launch(name="t", description="", args={}, nodes=nodes))
        for left, right in ticks:
            loop.run(until_ns=loop.now_ns + TICK_NS)
            loop.publish("wheel_ticks", WheelTicks(Header.of(loop.now_ns, ""), left, right), "board")
        loop.run(until_ns=loop.now_ns + round(silence * 1e9))


@given(st.sampled_from(sorted(ROBOTS)), st.integers(-(10**6), 10**6), st.integers(-(10**6), 10**6))
def test_link_poses_follow_from_the_joint_positions(name: str, left: int, right: int) -> None:
    """The transforms are those of MuJoCo's kinematics of the URDF at the joint positions; each link has one."""
    robot = ROBOTS[name]
    published = PublishedStates(robot, [(left, right)])
    model = mujoco.MjModel.from_xml_string(urdf(robot))
    data = mujoco.MjData(model)
    state = published.joints[-1]
    for joint, angle in zip(state.name, state.position, strict=True):
        data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(model, data)
    frames = {
        item.child_frame_id: item
        for item in (*published.frames[-1].transforms, *published.fixed[-1].transforms)
    }
    document = ET.fromstring(urdf(robot))
    links = {link.attrib["name"] for link in document.findall("link")}
    assert links - frames.keys() == {"base_footprint"}
    assert {
        joint.attrib["name"] for joint in document.findall("joint") if joint.attrib["type"] != "fixed"
    } == set(state.name)
    for link in ("wheel_left_link", "wheel_right_link"):
        at, turn = frames[link].transform.translation, frames[link].transform.rotation
        assert frames[link].header.frame_id == "base_link"
        assert (at.x, at.y, at.z) == pytest.approx(tuple(data.body(link).xpos), abs=1e-8)
        rotation = data.body(link).xmat.reshape(3, 3)
        assert matrix([turn.w, turn.x, turn.y, turn.z]) == pytest.approx(rotation, abs=1e-6)


@given(st.lists(st.tuples(st.integers(-12, 12), st.integers(-12, 12)), min_size=3, max_size=60))
def test_velocities_match_positions_at_a_limited_rate(steps: list[tuple[int, int]]) -> None:
    robot = ROBOTS["chefbot"]
    ticks = np.cumsum(steps, axis=0).tolist()
    states = PublishedStates(robot, [(left, right) for left, right in ticks]).joints
    per_turn = robot.motor.ticks_per_turn
    ends = {TICK_NS * (index + 1): pair for index, pair in enumerate(ticks)}
    for state in states:
        assert state.position == pytest.approx(np.array(ends[state.header.stamp.ns]) * 2 * np.pi / per_turn)
    for before, after in pairwise(states):
        time_ns = after.header.stamp.ns - before.header.stamp.ns
        assert time_ns >= PERIOD_NS
        assert after.velocity == pytest.approx((after.position - before.position) / (time_ns / 1e9))


def test_joint_states_without_a_board_after_silence_or_restart() -> None:
    robot = ROBOTS["chefbot"]
    no_board = PublishedStates(robot, [], silence=3.0)
    assert [list(state.position) for state in no_board.joints] == [[0.0, 0.0]] * 3
    assert len(no_board.frames) == 3 and all(len(state.velocity) == 0 for state in no_board.joints)
    silent = PublishedStates(robot, [(0, 0), (0, 0), (5, 5)], silence=3.0).joints
    assert len(silent) >= 4 and list(silent[-1].position) == list(silent[1].position)
    assert len(silent[1].velocity) == 2 and len(silent[-1].velocity) == 0
    restarted = PublishedStates(robot, [(10**6, 10**6)] * 3 + [(0, 0)] * 3).joints
    assert all(len(state.velocity) == 0 or not np.any(state.velocity) for state in restarted)


@pytest.mark.parametrize("name", ["base", "model_robot", "3dsensor", "amcl_demo", "robot_standalone"])
def test_launches_with_a_description_publish_joint_states(name: str) -> None:
    kinds = {entry.kind for entry in load_launch(name).nodes.values()}
    assert "chefbot.nodes.joint_states:JointStatesNode" in kinds

"""Base classes of nodes that report causes: when a report begins and ends, and which sensor it names."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.causes.reports import CAMERA, CONTACT, LIDAR, MAP, RANGER, SLOW, STOP, make_report
from chefbot.costmap import sources
from chefbot.costmap.layer import CellMark
from chefbot.costmap.layers import STATIC
from chefbot.costmap.sources import CAMERA as CAMERA_LAYER
from chefbot.costmap.sources import DROP_OFFS, LASER
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.nodes.causes.motion_reasons import CONDITION, MONITOR, MotionReasonsNode
from chefbot.nodes.causes.reports import CauseReportsNode, marked_place
from chefbot.robot.load import load_robot
from chefbot.runtime.node import NoParams, every
from chefbot.safety.collision_monitor import FREE, CheckedTwist
from chefbot.safety.monitor_text import SensedPoint


class Reporter(CauseReportsNode):
    """A node that reports what a test lets it find."""

    params: NoParams

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Base(MotionReasonsNode):
    """A node that commands the wheels."""

    params: NoParams

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Reports:
    """The reports of one node, `node`, at the time of its loop."""

    def __init__(self, kind: str) -> None:
        self.runner = NodeRunner({"one": f"{__name__}:{kind}"}, {})
        self.node: Any = self.runner.system.nodes["one"]

    def after(self, seconds: float) -> list[Cause]:
        """Return what was reported up to now, and let some time pass."""
        self.runner.run(seconds)
        return self.runner.messages("cause_reports")

    @property
    def kinds(self) -> list[str]:
        return [one.kind for one in self.after(0.0)]


class CostsWithMark:
    """Costs of which every cell has one mark."""

    def __init__(self, source: str) -> None:
        self._mark = CellMark(source, 3.5) if source else None

    def marked_by(self, x: float, y: float) -> CellMark | None:
        assert (x, y) == (1.0, 2.0)
        return self._mark


@pytest.mark.parametrize(
    ("source", "sensor"),
    [
        (STATIC, MAP),
        ("keep-out zone stairs", "keep-out zone stairs"),
        (sources.CONTACT, CONTACT),
        (sources.RANGER, RANGER),
        (LASER, LIDAR),
        (CAMERA_LAYER, CAMERA),
        (DROP_OFFS, CAMERA),
    ],
)
def test_a_marked_place_names_the_sensor_behind_its_layer(source: str, sensor: str) -> None:
    costs: Any = CostsWithMark(source)
    place = marked_place(costs, (1.0, 2.0), "odom", ROBOT)  # type: ignore[arg-type]
    assert place == (sensor, "odom", 1.0, 2.0, 3_500_000_000)


def test_without_a_lidar_the_planar_scan_is_the_cameras() -> None:
    costs: Any = CostsWithMark(LASER)
    assert marked_place(costs, (1.0, 2.0), "map", load_robot("chefbot"))[0] == CAMERA  # type: ignore


def test_without_a_cell_or_a_mark_there_is_no_place() -> None:
    unmarked: Any = CostsWithMark("")
    marked: Any = CostsWithMark(LASER)
    assert marked_place(unmarked, (1.0, 2.0), "odom", ROBOT) is None  # type: ignore[arg-type]
    assert marked_place(marked, None, "odom", ROBOT) is None


def test_an_episode_is_two_reports_with_node_and_times() -> None:
    reports = Reports("Reporter")
    found = make_report(SLOW, "check", "It is slow.")
    for _ in range(3):
        reports.node.report("motion", found)
        reports.after(0.1)
    for _ in range(7):
        reports.node.report("motion", None)
        reports.after(0.1)
    begin, end = reports.after(0.0)
    assert (begin.kind, begin.node, begin.check, begin.sentence) == (SLOW, "one", "check", "It is slow.")
    assert (end.kind, end.node, end.check) == ("end", "one", "check")
    assert begin.header.stamp.ns == 0
    assert end.header.stamp.ns == 700_000_000, "half a second after it was found last"


def test_what_is_found_for_a_moment_only_is_not_reported() -> None:
    reports = Reports("Reporter")
    found = make_report(SLOW, "check", "It is slow.")
    for k in range(20):
        reports.node.report("motion", found if k % 5 else None, 500_000_000)
        reports.after(0.1)
    assert reports.kinds == []
    for _ in range(6):
        reports.node.report("motion", found, 500_000_000)
        reports.after(0.1)
    assert reports.kinds == [SLOW]


def test_subjects_have_episodes_of_their_own_which_all_end() -> None:
    reports = Reports("Reporter")
    for subject in ("motion", "path"):
        reports.node.report(subject, make_report(SLOW, subject, "It is slow."))
    reports.node.end_reports()
    reports.node.end_reports()
    assert [(one.kind, one.check) for one in reports.after(0.0)] == [
        (SLOW, "motion"), (SLOW, "path"), ("end", "motion"), ("end", "path")
    ]  # fmt: skip


def test_what_has_no_duration_ends_when_it_begins() -> None:
    reports = Reports("Reporter")
    found = make_report("detour", "plan", "A detour.")
    reports.node.report_once(found)
    begin, end = reports.after(0.0)
    assert (begin.kind, end.kind) == ("detour", "end")
    assert msgspec.structs.replace(end, kind="detour").to_cdr() == begin.to_cdr()


# ---- of the node that commands the wheels

POINT = SensedPoint(LIDAR, 0.4, 0.1, 0.25)
LIMITED = CheckedTwist(0.2, "the lidar sees an obstacle 0.30 m ahead", POINT)
POSE = SE2(2.0, 1.0, math.pi / 2)


def limit_report(
    left: tuple[float, float], checked: CheckedTwist, fault: str = "", pose: SE2 | None = POSE
) -> Cause | None:
    """Return what is reported of a twist of 0.3 m/s and 0.1 rad/s of which this is left, one second after a start."""
    reports = Reports("Base")
    reports.after(1.0)
    reports.node.report_limit((0.3, 0.1), left, checked, fault, pose)
    found = reports.after(0.0)
    return found[0] if found else None


def test_a_limit_names_the_obstacle_and_what_is_left() -> None:
    cause = limit_report((0.06, 0.02), LIMITED)
    assert cause is not None and (cause.kind, cause.check, cause.sensor) == (SLOW, MONITOR, LIDAR)
    assert cause.sentence == "The lidar sees an obstacle 0.30 m ahead."
    assert (cause.numbers[0].value, len(cause.numbers)) == (pytest.approx(0.2), 1)
    # seen from a robot that looks along y, the point ahead on the left is farther along y and less along x
    assert cause.header.frame_id == "odom" and (cause.point.x, cause.point.y) == pytest.approx((1.9, 1.4))
    assert cause.marked_at.ns == 750_000_000


@pytest.mark.parametrize(
    ("left", "kind"),
    [
        ((0.0, 0.0), STOP),
        ((0.012, 0.004), STOP),
        ((0.0, -0.019), STOP),
        ((0.018, 0.006), SLOW),
        ((-0.2, 0.0), SLOW),
        ((0.26, 0.09), SLOW),
        ((0.271, 0.09), None),
        ((0.5, 0.5), None),
    ],
)
def test_the_kind_follows_from_what_is_left(left: tuple[float, float], kind: str | None) -> None:
    cause = limit_report(left, LIMITED)
    assert (None if cause is None else cause.kind) == kind


def test_ramps_and_small_limits_are_not_causes() -> None:
    assert limit_report((0.1, 0.0), FREE) is None, "the velocity limiter alone"
    assert limit_report((0.1, 0.0), CheckedTwist(0.9, "a limit")) is None
    assert limit_report((0.1, 0.0), CheckedTwist(0.89, "a limit")) is not None


def test_a_fault_of_a_sensor_comes_before_an_obstacle() -> None:
    for checked in (FREE, LIMITED):
        cause = limit_report((0.0, 0.0), checked, "The lidar is silent.")
        assert cause is not None and (cause.check, cause.sentence) == (CONDITION, "The lidar is silent.")
        assert cause.kind == STOP and not cause.located


def test_without_a_point_or_a_pose_there_is_no_place() -> None:
    for checked, pose in ((LIMITED, None), (CheckedTwist(0.0, "no sensor has seen the ground"), POSE)):
        cause = limit_report((0.0, 0.0), checked, pose=pose)
        assert cause is not None and cause.check == MONITOR and not cause.located


def test_a_robot_that_is_to_stand_is_not_limited() -> None:
    reports = Reports("Base")
    reports.node.report_limit((0.3, 0.0), (0.0, 0.0), LIMITED, "", POSE)
    for _ in range(8):
        reports.node.report_limit((0.0, 0.0), (0.0, 0.0), LIMITED, "The lidar is silent.", POSE)
        reports.after(0.1)
    assert reports.kinds == [STOP, "end"]


def test_why_commands_of_an_operator_do_not_count_is_reported() -> None:
    reports = Reports("Base")
    for refusal in ["Let go of the controls."] * 3 + [""] * 8:
        reports.node.report_limit((0.0, 0.0), (0.0, 0.0), FREE, "", POSE, refusal)
        reports.after(0.1)
    begin, end = reports.after(0.0)
    assert (begin.kind, begin.check, begin.sentence) == (STOP, CONDITION, "Let go of the controls.")
    assert end.kind == "end"


def test_a_fault_of_a_sensor_comes_before_held_controls() -> None:
    reports = Reports("Base")
    reports.node.report_limit((0.0, 0.0), (0.0, 0.0), FREE, "The lidar is silent.", POSE, "Let go.")
    assert reports.after(0.0)[0].sentence == "The lidar is silent."


def test_a_reason_is_published_when_it_changes() -> None:
    reports = Reports("Base")
    for sentence in ("", "Stopped: a.", "Stopped: a.", "Stopped: b.", ""):
        reports.node.explain(sentence)
        reports.after(0.1)
    reasons = [one.data for one in reports.runner.messages("collision_monitor/reason")]
    assert reasons == ["Stopped: a.", ""], "another reason waits half a second, the end does not"


def test_shares_are_of_both_components_of_a_twist() -> None:
    reports = Reports("Base")
    reports.node.report_limit((-0.3, 0.3), (-0.3, 0.0), LIMITED, "", None)
    (cause,) = reports.after(0.0)
    assert cause.kind == SLOW and cause.numbers[0].value == pytest.approx(0.5)
    assert np.isfinite([one.value for one in cause.numbers]).all()

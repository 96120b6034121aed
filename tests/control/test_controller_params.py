"""Parameters of the controller, and the built-in one made from them."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.controller_params import CONTROL_PERIOD, CONTROL_RATE, LIVE_PARAMS, ControllerParams
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalParams
from chefbot.costmap.params import LOCAL_COSTMAP
from chefbot.nodes.navigation.controller_params import ControllerNodeParams
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

ROBOT = load_robot("chefbot")


@given(st.floats(0.1, 1.0))
def test_only_the_speed_is_a_fraction_of_the_limits(speed: float) -> None:
    made = ControllerParams(speed=speed).make_dwa(ROBOT, DwaParams())
    limits = Limits.of(ROBOT)
    assert made.limits.speed == pytest.approx(speed * limits.speed)
    assert made.limits._replace(speed=limits.speed) == limits


@pytest.mark.parametrize(
    ("name", "wanted", "used"), [("chefbot", 0.9, 0.5), ("chefbot", 0.3, 0.3), ("jackal", 0.9, 0.9)]
)
def test_a_robot_that_sees_only_ahead_drives_no_tight_arcs(name: str, wanted: float, used: float) -> None:
    made = ControllerParams().make_dwa(load_robot(name), DwaParams(rotate_from=wanted))
    assert made.params.rotate_from == used


def test_the_given_settings_go_before_those_of_the_parameters() -> None:
    settings = DwaParams(path_weight=3.0, rotate_from=0.4)
    assert ControllerParams(settings=DwaParams(path_weight=2.0)).make_dwa(ROBOT, settings).params == settings


def test_the_period_of_the_settings_is_that_of_the_commands() -> None:
    assert ControllerParams().settings.period == CONTROL_PERIOD == pytest.approx(1.0 / CONTROL_RATE)


@pytest.mark.parametrize("speed", [0.0, 0.09, 1.01, -0.5, math.inf, math.nan, "fast"])
def test_a_speed_that_is_not_a_fraction_is_refused(speed: object) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"speed": speed}, ControllerParams)


def test_each_live_parameter_exists() -> None:
    names = {f"settings.{name}" for name in DwaParams.__struct_fields__}
    names |= {f"goal.{name}" for name in GoalParams.__struct_fields__} | set(
        ControllerParams.__struct_fields__
    )
    for pattern in LIVE_PARAMS:
        head, _, tail = pattern.partition("*")
        assert any(name.startswith(head) and name.endswith(tail) for name in names), pattern


def test_parameters_of_the_node_contain_the_controllers() -> None:
    given = {"speed": 0.5, "optional_sensors": ["lidar"], "costmap": {"inflation_radius": 0.3}}
    params = msgspec.convert(given, ControllerNodeParams)
    assert (params.speed, params.optional_sensors) == (0.5, ("lidar",))
    assert params.costmap.inflation_radius == 0.3
    defaults = ControllerNodeParams()
    assert defaults.costmap == LOCAL_COSTMAP and not defaults.costmap.track_unknown
    assert {name: getattr(defaults, name) for name in ControllerParams.__struct_fields__} == {
        name: getattr(ControllerParams(), name) for name in ControllerParams.__struct_fields__
    }


@pytest.mark.parametrize(
    "given", [{"optional_sensors": ["lydar"]}, {"costmap": {"padding": -0.1}}, {"costmaps": {}}]
)
def test_parameters_that_the_node_does_not_have_are_refused(given: dict[str, object]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(given, ControllerNodeParams)

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.keyboard_teleop import KeyboardTeleop
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

LIMITS = Limits.of(load_robot("chefbot"))


def hold(teleop, key, seconds):
    for _ in range(round(seconds * 10)):
        now = teleop.update(key, 0.1)
    return now


@pytest.mark.parametrize(
    ("key", "signs"),
    [
        ("u", (1, 1)),
        ("i", (1, 0)),
        ("o", (1, -1)),
        ("j", (0, 1)),
        ("l", (0, -1)),
        ("m", (-1, -1)),
        (",", (-1, 0)),
        (".", (-1, 1)),
    ],
)
def test_keys_are_those_of_teleop_twist_keyboard(key, signs):
    v, w = hold(KeyboardTeleop(LIMITS), key, 3.0)
    assert ((v > 0) - (v < 0), (w > 0) - (w < 0)) == signs


def test_silence_stops_the_robot_after_half_a_second():
    teleop = KeyboardTeleop(LIMITS)
    v, _ = hold(teleop, "i", 3.0)
    assert hold(teleop, None, 0.4)[0] == v
    assert 0 < hold(teleop, None, 0.3)[0] < v
    assert hold(teleop, None, 2.0) == (0.0, 0.0)


@pytest.mark.parametrize(("key", "left"), [(" ", 0.0), ("k", 0.0), ("y", 1.0)])
def test_stop_keys_stop_at_once_and_others_ramp_down(key, left):
    teleop = KeyboardTeleop(LIMITS)
    v, _ = hold(teleop, "i", 3.0)
    now, _ = teleop.update(key, 0.1)
    assert now == pytest.approx(left * (v - 0.02))


@given(st.text(alphabet="qzwxec uiojklm,.y", max_size=60))
def test_teleop_never_exceeds_the_robot_limits(keys):
    teleop = KeyboardTeleop(LIMITS)
    for key in keys:
        v, w = teleop.update(key, 0.1)
        assert abs(v) <= LIMITS.speed + 1e-9
        assert abs(w) <= LIMITS.angular_speed + 1e-9
        assert LIMITS.scale(v, w) > 1.0 - 1e-9


def test_speed_keys_scale_linear_and_angular_speed():
    teleop = KeyboardTeleop(LIMITS)
    v, w = teleop.speed, teleop.turn
    for key in "qwx":
        teleop.update(key, 0.1)
    assert teleop.speed == pytest.approx(v * 1.1 * 1.1 * 0.9)
    assert teleop.turn == pytest.approx(w * 1.1)

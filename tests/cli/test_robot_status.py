"""`chefbot drive status` against a served web UI."""

from __future__ import annotations

import math

import pytest
from tests.support.fake_robot import fake_robot

from chefbot.cli.drive import status as drive_status
from chefbot.cli.drive.status import place_sentence, show_status
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.ui.display.views import (
    DeliveryView,
    PlaybackView,
    RobotView,
    RoundStopView,
    StatusView,
    WaitingOrderView,
)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_status, "LAYER_TIMEOUT", 0.5)


@pytest.mark.slow
def test_all_that_is_known_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_places()
        robot.server.set_layer("robot", RobotView(x=2.0, y=1.1, yaw=math.pi / 2, v=0.25))
        later = WaitingOrderView(id="b", places=("table_1", "table_3"))
        on_the_way = DeliveryView(
            step="Driving to table 3.", queue=("table_2",), orders=(later,), errands=("home",)
        )
        robot.server.set_layer("delivery", on_the_way)
        warnings = ("Board: low battery [1]", "Lidar: late")
        known = StatusView(
            phase="Delivering.",
            battery=62.4,
            volts=11.6,
            pose_probability=0.97,
            localization="Localized to within 0.02 m.",
            warnings=warnings,
            reason="A door.",
        )
        robot.server.set_layer("status", known)
        assert show_status(robot.url) == 0
    out = capsys.readouterr().out
    rows = dict(line.split(None, 1) for line in out.splitlines())
    assert rows["speed"] == "0.25 m/s" and rows["activity"] == "Delivering."
    assert (
        rows["battery"] == "62 %, 11.6 V"
        and rows["localization"] == "97% probable. Localized to within 0.02 m."
    )
    assert rows["delivery"] == "Driving to table 3." and rows["warning"] == "Lidar: late"
    assert "last stop       A door.\n" in out
    assert "still to serve  窗边 2\nother goals     home\norder 1 waits   table 1 and table 3\n" in out


@pytest.mark.slow
def test_a_recording_is_called_one(capsys: pytest.CaptureFixture[str]) -> None:
    """Else its robot looks as if it were there, waiting for food."""
    with fake_robot() as robot:
        recording = PlaybackView(time=1.0, length=60.0, rate=1.0, title="run.mcap")
        robot.server.set_layer("playback", recording)
        robot.server.set_layer("status", StatusView())
        show_status(robot.url)
    assert capsys.readouterr().out.splitlines()[0] == "recording       run.mcap, no robot"


@pytest.mark.slow
def test_a_map_without_places_delivers_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.server.set_layer("status", StatusView())
        robot.show_waiting_for_order()
        show_status(robot.url)
    assert "delivery        not possible: no named places; store" in capsys.readouterr().out


@pytest.mark.slow
def test_the_stops_that_are_left_are_printed_with_their_times(capsys: pytest.CaptureFixture[str]) -> None:
    table = RoundStopView(place="table_2", distance=12.0, time=40.0, battery=70.0)
    home = RoundStopView(place="home", distance=45.0, time=660.0, battery=None)
    with fake_robot() as robot:
        robot.server.set_layer("delivery", DeliveryView(step="Driving.", queue=("table_2",)))
        robot.server.set_layer("forecast", (table, home))
        show_status(robot.url)
    out = capsys.readouterr().out
    stops = "table 2 in 12 m, about 40 s, 70 % battery; home in 45 m, about 11 min"
    assert f"stops left      {stops}\n" in out and "still to serve" not in out


@pytest.mark.slow
def test_an_active_emergency_stop_is_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.server.set_layer("status", StatusView(stopped=True, reason="Emergency stop was pressed."))
        assert show_status(robot.url) == 1
    out = capsys.readouterr().out
    assert "emergency stop  active" in out and out.count("unknown") == 4


@pytest.mark.slow
def test_a_robot_without_status_is_reported() -> None:
    with fake_robot() as robot:
        robot.server.set_layer("status", None)
        with pytest.raises(UserError, match="does not report its status"):
            show_status(robot.url)


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((2.0, 1.1), "at table 1; (2.00, 1.10) m, 90 degrees"),
        ((3.0, 1.0), "1.0 m from table 1; (3.00, 1.00) m, 90 degrees"),
    ],
)
def test_the_nearest_place_names_where_the_robot_is(pose: tuple[float, float], expected: str) -> None:
    robot = {"x": pose[0], "y": pose[1], "yaw": math.pi / 2}
    places = {"table_1": SE2(2.0, 1.0, 0.0), "kitchen": SE2(9.0, 1.0, 0.0)}
    assert place_sentence(robot, places) == expected
    assert place_sentence(robot, {}) == expected.partition("; ")[2]
    assert place_sentence(None, places) == "unknown"

"""Tests that CARMEN logs are parsed and that corrupt lines are reported."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.slam.carmen import CarmenLogError, beam_angles, parse, without_cut_line
from chefbot.slam.recorded_scan import NO_RETURN, RecordedOdometry, RecordedScan

ODOM = "ODOM 1.5 -2 0.25 0 0 0 976052857.5 host 12.25"
ROBOT_LASER = " ".join(
    (
        "ROBOTLASER1 0 -0.0175 0.035 0.0175 50 0.1 1 3 1 2.5 50.5 2 7 8",
        "1.1 2.1 0.1 1 2 0.1 0 0 0.3 0.2 1e30 976052858.25 h 13",
    )
)
SCAN = "FLASER 3 1 2.5 81.83 1.1 2.1 0.1 1 2 0.1 976052858.25 host 13"


def test_readings_have_the_order_of_the_lines() -> None:
    odom, scan = parse(f"# made up\nPARAM a b 1 host 2\n{ODOM}\n\n{SCAN}\n")
    assert odom == RecordedOdometry(976052857.5, SE2(1.5, -2, 0.25))
    assert isinstance(scan, RecordedScan)
    assert (scan.stamp, scan.laser, scan.odom) == (976052858.25, SE2(1.1, 2.1, 0.1), SE2(1, 2, 0.1))
    assert scan.ranges.tolist() == pytest.approx([1, 2.5, 81.83])


@pytest.mark.parametrize(
    ("n", "last", "step"), [(180, 89, 1), (181, 90, 1), (360, 89.5, 0.5), (361, 90, 0.5)]
)
def test_beams_start_at_minus_90_degrees(n: int, last: float, step: float) -> None:
    angles = np.degrees(beam_angles(n).astype(float))
    assert angles[0] == pytest.approx(-90, abs=1e-4)
    assert angles[-1] == pytest.approx(last, abs=1e-4)
    assert np.diff(angles) == pytest.approx(step, abs=1e-4)


@pytest.mark.parametrize(
    "line",
    [
        "FLASER",
        "FLASER many 1 2",
        "FLASER -3 1 2",
        "FLASER 0 1 1 1 1 1 1 1 h 1",
        "FLASER 99999999999999999999 1",
        SCAN.replace("FLASER 3", "FLASER 4"),
        SCAN.replace("2.1", "1e30"),
        SCAN.replace("81.83", "x"),
        ODOM.replace("1.5", "inf"),
        ODOM.replace("976052857.5", "soon"),
        ODOM[:12],
        ROBOT_LASER.replace(" 3 1 ", " 4 1 "),
        "ROBOTLASER1 0 1",
        ROBOT_LASER.replace("0.0175", "9"),
        ROBOT_LASER.replace(" 2 7 8 ", " -1 7 8 "),
        "PARAM laser_front_laser_fov 0 1 h 1",
        "PARAM robot_front_laser_max far 1 h 1",
    ],
)
def test_a_broken_line_is_reported_with_its_number(line: str) -> None:
    with pytest.raises(CarmenLogError, match=r"line 3 of the CARMEN log"):
        list(parse([ODOM, SCAN if line.startswith("FLASER") else ODOM, line]))


def test_inf_is_no_return_and_nan_is_invalid() -> None:
    (scan,) = parse(SCAN.replace("2.5", "nan").replace("81.83", "inf"))
    assert isinstance(scan, RecordedScan)
    assert scan.ranges.tolist() == [1.0, 0.0, NO_RETURN]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_last_line_that_was_cut_off_is_left_out(end: str) -> None:
    whole = f"{ODOM}{end}{SCAN}{end}"
    assert without_cut_line(whole) == (whole, "")
    assert without_cut_line(whole + ODOM) == (whole + ODOM, "")
    text, note = without_cut_line(whole + ODOM[:12])
    assert text == whole and note.startswith("The last line of the log is cut off")


def test_a_robotlaser_line_brings_its_angles_and_maximum_range() -> None:
    (scan,) = parse(ROBOT_LASER)
    assert isinstance(scan, RecordedScan)
    assert scan.angles.tolist() == pytest.approx([-0.0175, 0.0, 0.0175])
    assert scan.ranges.tolist() == pytest.approx([1, 2.5, NO_RETURN])
    assert (scan.stamp, scan.laser, scan.odom) == (976052858.25, SE2(1.1, 2.1, 0.1), SE2(1, 2, 0.1))


def test_scans_that_are_logged_twice_are_read_once() -> None:
    for first, second, beams in ((SCAN, ROBOT_LASER, 81.83), (ROBOT_LASER, SCAN, NO_RETURN)):
        scans = list(parse([first, second, first, second]))
        assert len(scans) == 2 and isinstance(scans[0], RecordedScan)
        assert scans[0].ranges[2] == pytest.approx(beams)


def test_parameters_of_the_front_laser_are_honoured() -> None:
    parameters = ["PARAM laser_front_laser_fov 270.0 1 h 1", "PARAM robot_front_laser_max 80 1 h 1"]
    (scan,) = parse([*parameters, SCAN])
    assert isinstance(scan, RecordedScan)
    assert np.degrees(scan.angles).tolist() == pytest.approx([-135.0, 0.0, 135.0])
    assert scan.ranges.tolist() == pytest.approx([1, 2.5, NO_RETURN])


@given(st.integers(0, len(SCAN) - 1), st.text(st.characters(codec="ascii"), max_size=4))
def test_a_damaged_line_is_read_or_reported(at: int, damage: str) -> None:
    try:
        for r in parse([SCAN[:at] + damage + SCAN[at + len(damage) :]]):
            assert isinstance(r, RecordedScan) and math.isfinite(r.stamp) and np.isfinite(r.ranges).all()
    except CarmenLogError as e:
        assert "line 1" in str(e)

"""Tests each fault of the simulated robot at the wire: it acts in its time, on what it names, and leaves nothing."""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import Any

import numpy as np
import pytest
from tests.sim.faults.fault_runs import FaultRun

from chefbot.errors import UserError
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.load import load_robot
from chefbot.sim.faults import events as e
from chefbot.sim.faults.board_sensors import FaultyReading
from chefbot.sim.faults.simulated_robot import check_robot_has

AT, UNTIL, END = 1.5, 3.5, 6.0
"""Begin and end of the fault and end of the run, s."""
LASTING = {"at": AT, "until": UNTIL}
TOPICS = {
    "lidar": ("scan",),
    "depth_camera": ("camera/depth/image_raw", "camera/depth/camera_info"),
    "ultrasonic": ("ultrasonic",),
    "imu": ("imu/data",),
    "wheel_encoders": ("wheel_ticks",),
}
SENSOR_FAULTS: list[Any] = [
    *(
        kind(sensor=sensor, **LASTING)
        for kind in (e.SensorStop, e.SensorFreeze, e.SensorLate, e.SensorNoise)
        for sensor in TOPICS
    ),
    *(e.SensorHalfBlind(sensor=sensor, **LASTING) for sensor in ("lidar", "depth_camera")),
    e.SensorOffset(sensor="lidar", yaw=0.2, **LASTING),
    e.SensorOffset(sensor="lidar", range=0.1, **LASTING),
    e.SensorOffset(sensor="depth_camera", yaw=0.2, **LASTING),
    e.SensorOffset(sensor="depth_camera", range=0.1, **LASTING),
    e.SensorOffset(sensor="ultrasonic", range=0.1, **LASTING),
    e.SensorOffset(sensor="imu", rate=0.1, **LASTING),
    *(e.SensorUpsideDown(sensor=sensor, **LASTING) for sensor in ("lidar", "depth_camera", "imu")),
    e.ClockJump(clock="lidar", seconds=5.0, **LASTING),
    e.ClockJump(clock="depth_camera", seconds=-0.5, **LASTING),
]
OTHER_FAULTS: list[Any] = [
    e.WheelSlip(wheel="both", **LASTING),
    e.WheelStall(wheel="left", **LASTING),
    e.Bump(at=AT),
    e.Carried(at=AT),
    e.VoltageDrop(share=0.8, **LASTING),
    e.WrongVoltageReading(voltage=9.0, **LASTING),
    e.BoardUnplugged(**LASTING),
    e.BitErrors(rate=0.01, **LASTING),
    e.ClockJump(clock="board", seconds=5.0, **LASTING),
]


def label(event: Any) -> str:
    keys = [key for key in event.__struct_fields__ if key not in ("at", "until", "sensor", "clock", "wheel")]
    target = getattr(event, "sensor", getattr(event, "clock", getattr(event, "wheel", "")))
    offset = [key for key in keys if key in ("yaw", "range", "rate") and getattr(event, key)]
    return "-".join([str(event.__struct_config__.tag), str(target), *offset])


def run_in_room(*events: Any, seed: int = 1) -> FaultRun:
    run = FaultRun(*events, world="room", profile="real", seed=seed).run(END)
    run.close()
    return run


@pytest.fixture(scope="module")
def healthy() -> FaultRun:
    """A robot that stands in a room, with the noise of real sensors."""
    return run_in_room()


@pytest.mark.rotated
@pytest.mark.parametrize("event", SENSOR_FAULTS, ids=label)
def test_a_sensor_fault_changes_its_sensor_and_nothing_else(event: Any, healthy: FaultRun) -> None:
    run = run_in_room(event)
    own = TOPICS[getattr(event, "sensor", getattr(event, "clock", ""))]
    others = (*own, "simulation/notice", "diagnostics")
    assert run.bytes_of(0.0, END, *others) == healthy.bytes_of(0.0, END, *others)
    assert run.bytes_of(0.0, AT)[own[0]] == healthy.bytes_of(0.0, AT)[own[0]]
    during, expected = run.bytes_of(AT, UNTIL), healthy.bytes_of(AT, UNTIL)
    if own != ("wheel_ticks",):  # the wheels of a standing robot have nothing to miscount
        assert during.get(own[0]) != expected[own[0]]
    recovery = 0.5
    after, expected = run.bytes_of(UNTIL + recovery), healthy.bytes_of(UNTIL + recovery)
    if own == ("imu/data",):  # the integrated angle has another history: the last digit of a mean
        assert len(after[own[0]]) == len(expected[own[0]])
    else:
        assert after[own[0]] == expected[own[0]]


def test_begin_and_end_are_reported_at_their_times() -> None:
    events = [*SENSOR_FAULTS, *OTHER_FAULTS]
    run = FaultRun(*events, drives=True).run(UNTIL + 0.1)
    run.close()
    begins = Counter((AT, f"Fault begins: {event.__struct_config__.tag}") for event in events)
    ends = Counter(
        (UNTIL, f"Fault ends: {event.__struct_config__.tag}")
        for event in events
        if not isinstance(event, e.Bump | e.Carried)
    )
    notices = Counter(
        (time, re.match(r"Fault (?:begins|ends): \w+", text).group()) for time, text in run.notices
    )
    assert notices == begins + ends


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_with_all_faults() -> None:
    runs = []
    for seed in (4, 4, 5):
        events = [event for event in [*SENSOR_FAULTS, *OTHER_FAULTS] if not isinstance(event, e.SensorStop)]
        runs.append(FaultRun(*events, drives=True, profile="real", seed=seed).run(END).bytes_of())
    assert runs[0] == runs[1] != runs[2]


# -- what each fault is like


def driven(*events: Any, until: float = END, **params: Any) -> FaultRun:
    run = FaultRun(*events, drives=True, **params).run(until)
    run.close()
    return run


def speeds(run: FaultRun, begin: float, end: float) -> list[float]:
    return [message.twist.twist.linear.x for message in run.on("ground_truth", begin, end)]


def test_silent_encoders_are_the_boards_fault_until_resume() -> None:
    run = FaultRun(e.SensorStop(sensor="wheel_encoders", at=AT, until=2.5), drives=True).run(AT)
    assert run.on("board_fault") == []
    run.run(AT + 0.5)
    (fault,) = run.on("board_fault")
    assert "encoder is silent" in fault.data and "press STOP, then Release STOP" in fault.data
    run.run(3.0)
    assert len(run.on("board_fault")) == 1, "encoders that count again do not clear it"
    for pressed in (True, False):
        run.loop.publish("emergency_stop", Bool(pressed), "base")
        run.run(run.loop.now_ns / 1e9 + 0.5)
    run.close()
    assert [fault.data for fault in run.on("board_fault")][1:] == [""]


@pytest.mark.slow
def test_a_stopped_sensor_is_silent() -> None:
    for sensor, (topic, *_) in TOPICS.items():
        run = driven(e.SensorStop(sensor=sensor, **LASTING))  # type: ignore[arg-type]
        messages = run.on(topic, AT + 0.25, UNTIL)
        if sensor == "wheel_encoders":
            assert len({(m.left, m.right) for m in messages}) == 1
        elif sensor == "imu":  # the ticks' lines go on, without an angle
            assert not messages
        else:
            assert not messages, sensor
        assert run.on(topic, UNTIL + 0.25), sensor


def turn_rate(run: FaultRun, begin: float, end: float) -> float:
    return float(np.mean([m.angular_velocity.z for m in run.on("imu/data", begin, end)]))


def test_a_late_reading_of_the_board_is_that_of_a_moment_ago() -> None:
    reading = FaultyReading(np.random.default_rng(1))
    reading.set_faults((e.SensorLate(at=0.0, sensor="imu", seconds=0.3),))
    step = 100_000_000
    late = [float(reading.apply(np.array([float(i)]), i * step)[0]) for i in range(8)]
    assert late == [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0]


def test_an_imu_upside_down_measures_the_opposite_turn() -> None:
    run = driven(e.SensorUpsideDown(sensor="imu", **LASTING), left=-1.0)
    upright, flipped = turn_rate(run, 1.0, AT), turn_rate(run, AT + 0.1, UNTIL)
    assert upright > 0.5 and flipped == pytest.approx(-upright, rel=0.05)
    assert run.on("imu/data", AT + 0.2)[0].linear_acceleration.z == pytest.approx(-9.8, abs=0.1)


def uncounted(event: Any) -> int:
    """Return how many ticks of the left wheel the board has not counted at the end."""
    run = driven(event)
    return run.simulation.wheel_ticks()[0] - run.on("wheel_ticks")[-1].left


@pytest.mark.slow
def test_encoder_faults_miscount_and_late_counts_catch_up() -> None:
    assert abs(uncounted(e.SensorLate(sensor="wheel_encoders", seconds=0.2, **LASTING))) < 150
    assert 0 < abs(uncounted(e.SensorNoise(sensor="wheel_encoders", share=0.5, **LASTING))) < 1500
    assert uncounted(e.SensorStop(sensor="wheel_encoders", **LASTING)) > 200


def scans(event: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return a scan of a standing robot before and during a fault, without noise."""
    run = FaultRun(event, world="room").run(AT + 1.0)
    run.close()
    return run.on("scan", 0.0, AT)[-1].ranges, run.on("scan", AT + 0.3)[-1].ranges


def test_a_turned_lidar_sees_the_room_turned() -> None:
    step = 2.0 * math.pi / 360
    before, during = scans(e.SensorOffset(sensor="lidar", yaw=20 * step, **LASTING))
    assert len(before) == 360
    assert np.allclose(during, np.roll(before, -20), atol=1e-4)


def test_a_lidar_upside_down_sees_the_room_mirrored() -> None:
    before, during = scans(e.SensorUpsideDown(sensor="lidar", **LASTING))
    mirrored = np.roll(before[::-1], 1)
    assert np.allclose(during, mirrored, atol=1e-4) and not np.allclose(during, before, atol=0.1)


def test_a_camera_upside_down_turns_the_image() -> None:
    run = FaultRun(e.SensorUpsideDown(sensor="depth_camera", **LASTING), world="room").run(AT + 1.0)
    run.close()
    before, during = (
        image.data.view(np.float32).reshape(image.height, image.width)
        for image in (run.on(TOPICS["depth_camera"][0])[i] for i in (0, -1))
    )
    both = ~np.isnan(before) & ~np.isnan(during[::-1, ::-1])
    assert both.mean() > 0.3
    assert np.median(np.abs(before[both] - during[::-1, ::-1][both])) < 0.005


def test_slipping_wheels_turn_faster_than_the_robot_drives() -> None:
    run = driven(e.WheelSlip(wheel="both", share=0.01, at=0.1), until=3.0)
    first, last = run.on("wheel_ticks")[0], run.on("wheel_ticks")[-1]
    turned = (last.left - first.left) * run.simulation.robot.metres_per_tick
    assert run.pose.x < 0.8 * turned


def test_a_stalled_wheel_stands_until_the_firmware_notices() -> None:
    run = driven(e.WheelStall(wheel="left", **LASTING))
    before, after = (run.on("wheel_ticks", t, t + 0.1)[0] for t in (AT + 0.02, UNTIL - 0.1))
    assert abs(after.left - before.left) < 150 and after.right - before.right > 500
    assert "left wheel is blocked" in run.on("diagnostics")[-1].status[0].message


def test_a_bump_shoves_the_robot_with_its_impulse() -> None:
    straight, shoved = driven(until=3.0), driven(e.Bump(at=2.0, impulse=4.0), until=3.0)
    assert abs(straight.pose.y) < 0.005 < abs(shoved.pose.y) or shoved.pose.yaw != pytest.approx(
        0.0, abs=0.02
    )
    assert np.all(shoved.simulation._data.xfrc_applied == 0.0)


def test_a_carried_robot_is_placed_by_the_event_or_the_seed() -> None:
    run = FaultRun(e.Carried(at=1.0, to=(0.3, -0.4, 1.0)), world="room").run(1.5)
    run.close()
    assert (run.pose.x, run.pose.y, run.pose.yaw) == pytest.approx((0.3, -0.4, 1.0), abs=0.02)
    drawn = []
    for seed in (1, 1, 2):
        run = FaultRun(e.Carried(at=1.0), world="room", seed=seed).run(1.1)
        run.close()
        drawn.append(run.pose)
    assert drawn[0] == drawn[1] != drawn[2]


def test_a_voltage_drop_slows_the_robot_a_wrong_reading_does_not() -> None:
    def voltage(run: FaultRun) -> float:
        return float(run.on("battery_state", 4.0, 5.0)[-1].voltage)

    during: dict[str, float] = {"at": 1.0, "until": 5.5}
    healthy, dropped = driven(), driven(e.VoltageDrop(share=0.2, **during))
    misread = driven(e.WrongVoltageReading(voltage=12.5, **during))
    assert voltage(dropped) == pytest.approx(0.2 * voltage(healthy), rel=0.05)
    assert voltage(misread) == pytest.approx(12.5, abs=0.05)
    assert np.mean(speeds(dropped, 2.0, 5.0)) < 0.8 * np.mean(speeds(healthy, 2.0, 5.0))
    assert misread.pose == healthy.pose


def test_an_unplugged_board_is_silent_and_stops_the_wheels() -> None:
    run = driven(e.BoardUnplugged(**LASTING), until=8.0)
    assert not run.on("wheel_ticks", AT + 0.1, UNTIL) and run.on("wheel_ticks", UNTIL + 1.5)
    assert max(map(abs, speeds(run, AT + 1.0, UNTIL))) < 0.01


def test_bit_errors_reach_both_ends_of_the_line() -> None:
    run = driven(e.BitErrors(rate=0.005, **LASTING))
    assert run.board.link.session.damaged > 10 and run.board.motors.state.refused > 5
    assert len(run.on("wheel_ticks", UNTIL + 1.0)) == len(driven().on("wheel_ticks", UNTIL + 1.0))


@pytest.mark.parametrize(
    ("clock", "topic"),
    [("lidar", "scan"), ("depth_camera", TOPICS["depth_camera"][0]), ("board", "wheel_ticks")],
)
def test_a_clock_jump_moves_the_stamps(clock: Any, topic: str) -> None:
    """The driver of the board follows a jump within its window of one second."""
    run = driven(e.ClockJump(clock=clock, seconds=0.3, at=1.0, until=4.0), until=7.0)
    ahead = [
        (item.time_ns / 1e9, item.message.header.stamp.ns - item.time_ns)  # type: ignore[attr-defined]
        for item in run.published
        if item.topic == topic
    ]
    during = [late for time, late in ahead if 3.0 < time < 4.0]
    after = [late for time, late in ahead if time > 6.0]
    assert np.median(during) == pytest.approx(0.3e9, abs=0.06e9)
    assert np.median(after) == pytest.approx(0.0, abs=0.06e9)


# -- requests of an operator


def request(run: FaultRun, text: str) -> None:
    run.loop.publish("simulation/fault", String(text), "test", from_device=True)


def test_an_operator_begins_and_ends_faults_with_the_same_keys() -> None:
    run = FaultRun().run(1.0)
    for text in ("freeze lidar", "slip both share=0.5", "voltage_drop"):
        request(run, text)
    run.run(1.1)
    assert [text.split()[2] for _, text in run.notices] == ["freeze", "slip", "voltage_drop"]
    request(run, "none lidar")
    run.run(1.2)
    request(run, "none")
    run.run(1.3)
    run.close()
    assert [text for _, text in run.notices[3:]] == [
        "Fault ends: freeze of lidar.",
        "Fault ends: slip of both.",
        "Fault ends: voltage_drop.",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("broken lidar", "broken"),
        ("freeze lidr", "lidar"),
        ("", "fault"),
        ("slip left share=2", "below 1"),
        ("late imu seconds=soon", "seconds"),
    ],
)
def test_a_wrong_request_is_answered_in_one_sentence(text: str, expected: str) -> None:
    run = FaultRun().run(0.5)
    request(run, text)
    run.run(0.6)
    run.close()
    assert [expected in notice for _, notice in run.notices] == [True]


def test_an_event_for_a_sensor_that_the_robot_lacks_is_refused() -> None:
    with pytest.raises(UserError, match="robot chefbot has no lidar"):
        check_robot_has(load_robot("chefbot"), e.SensorStop(at=1.0, sensor="lidar"))

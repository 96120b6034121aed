"""IMUs on a serial line: samples, their times, damaged bytes, and the configuration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.imu import bno085, witmotion
from chefbot.imu.models import IMUS
from chefbot.imu.session import ImuSample, ImuSession
from chefbot.robot.sensors import IMU_DRIVERS

AT_REST = (0.0, 0.0, 9.80665)
PERIODS_NS = {"bno085_rvc": 10_000_000, "witmotion": 10_000_000, "witmotion_9600": 50_000_000}
START_NS = 5_000_000_000


def stream(driver: str, rate: float, count: int) -> list[tuple[int, bytes]]:
    """Return what a sensor that turns sends: time of the first byte of each sample, ns, and its bytes."""
    period = PERIODS_NS[driver]

    def one(i: int) -> bytes:
        if driver == "bno085_rvc":
            return bno085.encode(i, rate * i * period / 1e9, AT_REST)
        packets = ((witmotion.ACCELERATION, AT_REST), (witmotion.RATES, (0.01, -0.02, rate)))
        return b"".join(witmotion.encode(kind, values) for kind, values in packets)

    return [(START_NS + i * period, one(i)) for i in range(count)]


def receive(
    session: ImuSession, baud: int, sent: list[tuple[int, bytes]], latency_ns: int = 0
) -> list[ImuSample]:
    samples = []
    for began_ns, data in sent:
        end_ns = began_ns + round(len(data) * 10e9 / baud)
        samples += session.receive_data(data, end_ns + latency_ns)
    return samples


def test_each_driver_of_the_robot_file_has_a_model() -> None:
    assert set(IMUS) == set(IMU_DRIVERS) == set(PERIODS_NS)


@pytest.mark.parametrize("driver", IMU_DRIVERS)
@given(st.floats(-3.0, 3.0))
def test_rates_and_acceleration_arrive_at_their_times(driver: str, rate: float) -> None:
    model = IMUS[driver]
    samples = receive(model.open(), model.baud, stream(driver, rate, 40))
    assert len(samples) >= 36
    # the angle that the rates add up to
    angle = sum(sample.rates[2] for sample in samples) * PERIODS_NS[driver] / 1e9
    assert angle == pytest.approx(rate * len(samples) * PERIODS_NS[driver] / 1e9, abs=0.002)
    assert all(sample.acceleration == pytest.approx(AT_REST, abs=0.01) for sample in samples)
    stamps = np.array([sample.stamp_ns for sample in samples])
    # within a packet of the time at which the sample began on the line
    late = stamps - START_NS - PERIODS_NS[driver] * np.arange(40 - len(samples), 40)
    assert (np.abs(late) <= 12e9 * 10 / model.baud).all()


@pytest.mark.parametrize("driver", IMU_DRIVERS)
def test_samples_that_arrive_together_have_their_own_times(driver: str) -> None:
    model, sent = IMUS[driver], stream(driver, 0.5, 60)
    session, samples = model.open(), []
    for i in range(0, len(sent), 3):  # an adapter that sends on every third sample
        data = b"".join(part for _, part in sent[i : i + 3])
        samples += session.receive_data(data, sent[min(i + 2, len(sent) - 1)][0] + 3_000_000)
    steps = np.diff([sample.stamp_ns for sample in samples])[10:]
    assert (steps > 0.45 * PERIODS_NS[driver]).all() and (steps < 2.0 * PERIODS_NS[driver]).all()


@pytest.mark.parametrize("driver", IMU_DRIVERS)
@given(st.data())
def test_bytes_may_be_split_anywhere(driver: str, data: st.DataObject) -> None:
    whole = b"".join(part for _, part in stream(driver, 0.3, 12))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=8)))
    session, samples = IMUS[driver].open(), []
    for first, last in zip([0, *cuts], [*cuts, len(whole)], strict=True):
        samples += session.receive_data(whole[first:last], START_NS)
    expected = IMUS[driver].open().receive_data(whole, START_NS)
    assert [one.rates for one in samples] == [one.rates for one in expected]


@pytest.mark.parametrize("driver", IMU_DRIVERS)
@given(st.integers(0, 10_000), st.sampled_from(["flip", "lose", "insert"]))
def test_a_damaged_byte_gives_no_wrong_rate(driver: str, place: int, fault: str) -> None:
    whole = bytearray(b"".join(part for _, part in stream(driver, 0.4, 20)))
    at = place % len(whole)
    if fault == "flip":
        whole[at] ^= 0x10
    elif fault == "lose":
        del whole[at]
    else:
        whole.insert(at, 0x37)
    samples = IMUS[driver].open().receive_data(bytes(whole), START_NS)
    assert len(samples) >= 15
    assert all(sample.rates[2] == pytest.approx(0.4, abs=0.02) for sample in samples)


def test_a_gap_that_the_index_cannot_count_is_left_out() -> None:
    session = bno085.Bno085Session()
    model = IMUS["bno085_rvc"]
    sent = stream("bno085_rvc", 0.5, 300)
    before = receive(session, model.baud, sent[:20])
    after = receive(session, model.baud, sent[120:])
    assert len(before) == 19 and all(one.rates[2] == pytest.approx(0.5, abs=0.02) for one in before + after)


def test_yaw_passes_half_a_turn_without_a_jump() -> None:
    session = bno085.Bno085Session()
    frames = [bno085.encode(i, math.pi - 0.02 + 0.01 * i, AT_REST) for i in range(8)]
    rates = [sample.rates[2] for sample in session.receive_data(b"".join(frames), START_NS)]
    assert rates == pytest.approx([1.0] * len(rates), abs=0.03) and len(rates) == 7


@pytest.mark.parametrize(("driver", "code"), [("witmotion", 0x09), ("witmotion_9600", 0x07)])
def test_the_configuration_is_sent_slowly_and_once(driver: str, code: int) -> None:
    session = IMUS[driver].open()
    sent = [session.data_to_send(i * 100_000_000) for i in range(40)]
    commands = [bytes.fromhex(text) for text in ("ffaa6988b5", "ffaa020600", f"ffaa03{code:02x}00")]
    assert [data for data in sent if data] == commands
    assert [i for i, data in enumerate(sent) if data] == [0, 5, 10]


def test_a_packet_of_the_maker_s_manual() -> None:
    """55 52, angular velocity (1, -1, 32767) units, then another packet behind it."""
    body = bytes.fromhex("55520100ffffff7f0000")
    packet = body + bytes((sum(body) % 256,))
    force = witmotion.encode(witmotion.ACCELERATION, AT_REST)
    samples = IMUS["witmotion"].open().receive_data(force + packet + force, START_NS)
    assert samples[0].rates == pytest.approx(
        (6.1e-5 * 17.4533, -6.1e-5 * 17.4533, math.radians(2000.0)), rel=1e-2
    )


@pytest.mark.parametrize("driver", IMU_DRIVERS)
@given(st.binary(max_size=400))
def test_random_bytes_are_not_samples(driver: str, data: bytes) -> None:
    assert len(IMUS[driver].open().receive_data(data, START_NS)) <= len(data) // 19

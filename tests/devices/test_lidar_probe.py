"""The recognition of a lidar at a port: when it is queried, when it is recognized, and what is there instead."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from tests.lidar.wires import Wire

from chefbot.board.framing import frame
from chefbot.devices.lidar_probe import LISTENING_NS, MIN_SAMPLES, TIMEOUT_NS, LidarProbe
from chefbot.devices.serial_ports import BAUD
from chefbot.lidar.emulators import RplidarEmulator
from chefbot.lidar.models import LIDARS

START_NS = 5_000_000_000
QUERIED = ["rplidar_a1", "rplidar_c1", "ydlidar_x4", "ydlidar_tmini"]
BY_ITSELF = ["ld19", "ydlidar_x2"]
BOARD_LINE = frame("e 10 12 0")


def probe_of(driver: str, *, alone: bool) -> tuple[LidarProbe, Any]:
    model = LIDARS[driver]
    port: Any = SimpleNamespace(baudrate=model.baud)
    return LidarProbe(model, port, START_NS, alone=alone), port


@pytest.mark.parametrize("driver", QUERIED)
def test_at_the_port_of_the_robot_file_it_probes_at_once(driver: str) -> None:
    probe, port = probe_of(driver, alone=True)
    assert probe.data_to_send(START_NS) and port.baudrate == LIDARS[driver].baud


@pytest.mark.parametrize("driver", QUERIED)
def test_where_a_board_may_be_it_listens_first_at_its_rate(driver: str) -> None:
    probe, port = probe_of(driver, alone=False)
    assert port.baudrate == BAUD
    for now_ns in range(START_NS, START_NS + LISTENING_NS, 100_000_000):
        assert probe.data_to_send(now_ns) == b"" and port.baudrate == BAUD
    assert probe.data_to_send(START_NS + LISTENING_NS) and port.baudrate == LIDARS[driver].baud


@pytest.mark.parametrize("driver", BY_ITSELF)
@pytest.mark.parametrize("alone", [False, True])
def test_a_lidar_that_sends_by_itself_needs_no_question(driver: str, alone: bool) -> None:
    probe, port = probe_of(driver, alone=alone)
    assert port.baudrate == LIDARS[driver].baud
    for now_ns in range(START_NS, START_NS + TIMEOUT_NS, 500_000_000):
        assert probe.data_to_send(now_ns) == b""


@pytest.mark.parametrize("driver", [*QUERIED, *BY_ITSELF])
def test_enough_samples_are_the_lidar(driver: str) -> None:
    wire, (probe, _) = Wire(driver), probe_of(driver, alone=True)
    now_ns, samples, found = START_NS, 0, None
    for _ in range(400):
        now_ns += 50_000_000
        answer = wire.lidar.receive(probe.data_to_send(now_ns))
        found = probe.receive_data(answer, now_ns) if answer else found
        if wire.lidar.scanning:
            samples += wire.lidar.samples
            found = probe.receive_data(wire.frame(), now_ns)
        if found is not None:
            break
        assert not probe.timed_out(now_ns)
    assert found is not None and samples >= MIN_SAMPLES
    assert found.startswith("model 0x18") if driver.startswith("rplidar") else found == ""
    assert samples < 3 * MIN_SAMPLES + 3 * 96, "not much later than there were enough"


@pytest.mark.parametrize("driver", QUERIED)
def test_a_board_is_left_alone(driver: str) -> None:
    probe, _ = probe_of(driver, alone=False)
    assert probe.receive_data(b"garbage\n" + BOARD_LINE, START_NS) is None
    assert probe.timed_out(START_NS) and probe.failure_reason == "a motor board is there"
    assert probe.data_to_send(START_NS + 100_000_000) == b""


@pytest.mark.parametrize(("alone", "limit_ns"), [(True, TIMEOUT_NS), (False, LISTENING_NS + TIMEOUT_NS)])
def test_a_motor_has_some_seconds_from_the_question_on(alone: bool, limit_ns: int) -> None:
    probe, _ = probe_of("rplidar_a1", alone=alone)
    for now_ns in range(START_NS, START_NS + limit_ns, 100_000_000):
        probe.data_to_send(now_ns)
        assert not probe.timed_out(now_ns)
    assert probe.timed_out(START_NS + limit_ns)


def test_the_reason_names_whether_anything_was_sent() -> None:
    name = f"{LIDARS['ld19'].maker} at {LIDARS['ld19'].baud} baud"
    silent, _ = probe_of("ld19", alone=True)
    assert silent.failure_reason.startswith(f"no data from a {name} there")
    other, _ = probe_of("ld19", alone=True)
    assert other.receive_data(b"something else" * 50, START_NS) is None
    assert other.failure_reason.startswith(f"the data there are not from a {name}")


def test_a_damaged_lidar_ends_the_search_with_its_fault() -> None:
    wire, (probe, _) = Wire("rplidar_c1"), probe_of("rplidar_c1", alone=True)
    assert isinstance(wire.lidar, RplidarEmulator)
    wire.lidar.healthy = False
    now_ns = START_NS
    while not probe.timed_out(now_ns):
        now_ns += 50_000_000
        assert probe.receive_data(wire.lidar.receive(probe.data_to_send(now_ns)), now_ns) is None
    assert now_ns < START_NS + TIMEOUT_NS and "the lidar reports a fault" in probe.failure_reason

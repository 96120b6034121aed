"""What every driver of a sensor with a line of its own reports: found, silent, damaged, defective, lost."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from tests.support.nodes import NodeRunner

from chefbot.devices.serial_sensor import SensorText, SerialSensorDevice
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus
from chefbot.runtime.node import NoParams

TEXT = SensorText("thermometer", "Acme T1", "thermometer_link", "temperature", "temperatures")


class ThermometerDevice(SerialSensorDevice[SimpleNamespace]):
    """The driver without its thread: the test calls what that would."""

    params: NoParams

    def start(self) -> None:
        self._open_session, self._text, self._port = self.new_session, TEXT, "auto"
        self.session, self._received_ns, self._published = None, 0, 0
        self._problem, self._damaged, self._missing = "the thermometer has not been found yet", 0, False
        self._line = SimpleNamespace(send=lambda _: None, close=lambda _: None)  # type: ignore[assignment]

    def new_session(self) -> SimpleNamespace:
        return SimpleNamespace(data_to_send=lambda _: b"", damaged=0, description="version 7")

    def process(self, session: SimpleNamespace, data: bytes, received_ns: int) -> None:  # noqa: ARG002
        session.damaged += data == b"?"
        if data != b"?":
            self.note_published()


class Thermometer:
    def __init__(self) -> None:
        self.runner = NodeRunner({"thermometer": f"{__name__}:ThermometerDevice"}, {})
        self.device: ThermometerDevice = self.runner.system.nodes["thermometer"]  # type: ignore[assignment]

    def status(self, *data: bytes) -> DiagnosticStatus:
        """Receive data within two seconds, and return the health after it."""
        self.runner.run(1.5)
        for one in data:
            self.device._on_data(one, 0)
        self.runner.run(0.5)
        (newest,) = self.runner.messages("diagnostics")[-1].status
        return newest  # type: ignore[no-any-return]

    @property
    def notices(self) -> list[str]:
        return [one.data for one in self.runner.messages("notice")]


@pytest.fixture
def thermometer() -> Thermometer:
    return Thermometer()


def test_a_sensor_is_missing_found_and_healthy(thermometer: Thermometer) -> None:
    status = thermometer.status()
    assert (status.level, status.message) == (ERROR, "The thermometer has not been found yet.")
    thermometer.device._on_open("/dev/ttyUSB3")
    status = thermometer.status(b"21.5")
    assert (status.level, status.message) == (OK, "The thermometer sends temperatures.")
    assert status.hardware_id == "/dev/ttyUSB3"
    values = {one.key: one.value for one in status.values}
    assert values == {"driver": "Acme T1", "thermometer": "version 7", "temperatures": "1"}
    assert thermometer.notices == ["Thermometer at /dev/ttyUSB3."]


def test_silence_and_damaged_packets_are_reported(thermometer: Thermometer) -> None:
    thermometer.device._on_open("/dev/ttyUSB3")
    status = thermometer.status(b"?", b"21.5", b"?")
    assert (status.level, status.message) == (
        WARN,
        "2 packets of the thermometer were damaged in the last second.",
    )
    status = thermometer.status()
    assert status.level == ERROR and status.message == "The thermometer has sent no temperature for 2 s."


def test_a_lost_sensor_is_looked_for_and_its_data_are_ignored(thermometer: Thermometer) -> None:
    thermometer.device._on_open("/dev/ttyUSB3")
    thermometer.device._on_lost("the cable is out")
    status = thermometer.status(b"21.5")
    assert (status.level, status.message) == (ERROR, "The cable is out.")
    assert {one.key: one.value for one in status.values}["temperatures"] == "0"
    assert thermometer.notices[-1] == "The cable is out; looking for it again."
    thermometer.device._on_open("/dev/ttyUSB4")
    assert thermometer.status(b"21.5").level == OK


def test_a_search_without_result_is_reported_once(thermometer: Thermometer) -> None:
    for _ in range(3):
        thermometer.device._on_missing("no port sends temperatures")
    status = thermometer.status()
    sentence = "No thermometer found: no port sends temperatures."
    assert (status.level, status.message) == (ERROR, sentence) and thermometer.notices == [sentence]

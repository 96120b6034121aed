"""Driver of IMUs on a serial line of their own."""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
import serial
from msgspec import Meta

from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_ports import READ_TIMEOUT
from chefbot.devices.serial_sensor import SensorText, SerialSensorDevice
from chefbot.imu.models import IMUS, ImuModel
from chefbot.imu.session import ImuSample, ImuSession
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.node import Out, topic

FRAME = "imu_link"
MIN_SAMPLES = 10
"""Samples by which an IMU is recognized."""
SEARCH_NS = 3_000_000_000
"""Time after which a port at which no such IMU sends is left, ns."""
UNKNOWN_ORIENTATION = np.array([-1.0, *[0.0] * 8])
"""Covariance of an orientation that is not measured (sensor_msgs/Imu)."""


class SerialImuParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of an IMU's driver; the robot file names the model."""

    port: Annotated[
        str,
        Meta(
            description="a serial port's path, or auto: where such an IMU sends; empty: as in the robot file"
        ),
    ] = ""


class SerialImuDevice(SerialSensorDevice[ImuSession]):
    """Publishes the samples of the robot's IMU.

    An IMU without a driver in the robot file is wired to the motor board, and this node does nothing.
    """

    params: SerialImuParams
    imu: Out[Imu] = topic("imu/data")
    notice: Out[String] = topic("imu/notice")

    def start(self) -> None:
        """Begin to look for the IMU."""
        imu = self.robot.sensors.imu
        if not imu.driver:
            for port in (self.imu, self.diagnostics, self.notice):
                port.unadvertise()
            return
        model = IMUS[imu.driver]
        self._gyro_variance = imu.gyro_noise**2
        self._acceleration_covariance = imu.accelerometer_noise**2 * np.eye(3).reshape(9)
        self._newest_ns = 0
        text = SensorText("IMU", model.maker, FRAME, "sample", "samples")
        self.connect(self.params.port or imu.port, imu_device(model), model.open, text)

    def process(self, session: ImuSession, data: bytes, received_ns: int) -> None:
        """Publish the samples in received bytes."""
        for sample in session.receive_data(data, received_ns):
            if sample.stamp_ns > self._newest_ns:
                self._newest_ns = sample.stamp_ns
                self.note_published()
                self.imu.publish(self._message(sample))

    def _message(self, sample: ImuSample) -> Imu:
        rates_covariance = np.zeros(9)
        rates_covariance[::4] = np.array(sample.rates_variance) + self._gyro_variance  # the diagonal
        return Imu(
            Header.of(sample.stamp_ns, FRAME),
            orientation_covariance=UNKNOWN_ORIENTATION,
            angular_velocity=Vector3(*sample.rates),
            angular_velocity_covariance=rates_covariance,
            linear_acceleration=Vector3(*sample.acceleration),
            linear_acceleration_covariance=self._acceleration_covariance,
        )


class ImuProbe:
    """Recognizes an IMU of one model at a port by samples with valid checksums; nothing is sent before that."""

    def __init__(self, model: ImuModel, now_ns: int) -> None:
        self._model, self._session = model, model.open()
        self._start_ns, self._samples, self._received = now_ns, 0, 0

    def data_to_send(self, now_ns: int) -> bytes:  # noqa: ARG002 (interface)
        """Return nothing: another device may be there."""
        return b""

    def receive_data(self, data: bytes, now_ns: int) -> str | None:
        """Process received bytes; return the IMU's maker once it has sent enough samples."""
        self._received += len(data)
        self._samples += len(self._session.receive_data(data, now_ns))
        return self._model.maker if self._samples >= MIN_SAMPLES else None

    def timed_out(self, now_ns: int) -> bool:
        """Return whether no such IMU is there."""
        return now_ns - self._start_ns >= SEARCH_NS

    @property
    def failure_reason(self) -> str:
        """What is there instead, as a sentence for the operator."""
        if self._received:
            return f"the data there are not from a {self._model.maker}"
        return f"no data from a {self._model.maker} there"


def imu_device(model: ImuModel) -> SerialDevice[str]:
    """Return how an IMU is opened and recognized."""

    def opened(path: str) -> serial.Serial:
        port = serial.Serial(path, model.baud, timeout=READ_TIMEOUT, write_timeout=0, exclusive=True)
        port.reset_input_buffer()
        return port

    return SerialDevice("IMU", opened, lambda _, now_ns, __: ImuProbe(model, now_ns))

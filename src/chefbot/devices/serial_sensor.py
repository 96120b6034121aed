"""Common base of the drivers of sensors on a serial line of their own."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar, Generic, NamedTuple, Protocol, TypeVar

from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_connection import ConnectionEvents, SerialConnection
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, Out, every


class SensorSession(Protocol):
    """The session with one sensor since its port was opened."""

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes that are due now."""

    @property
    def damaged(self) -> int:
        """Number of frames with a wrong checksum."""

    @property
    def description(self) -> str:
        """What the sensor has reported about itself; empty for nothing."""


S = TypeVar("S", bound=SensorSession)


class SensorText(NamedTuple):
    """Words about a sensor: its name, its maker and models, its frame, and what it sends, singular and plural."""

    name: str
    maker: str
    frame: str
    datum: str
    data: str


class SerialSensorDevice(Device, Generic[S]):
    """Base of a sensor's driver: a thread reads, the bytes are decoded in the event loop, and health is published.

    The sensor is back after its cable was out, on any port. Subclasses call `connect` in `start`.
    """

    SILENCE_NS: ClassVar[int] = 1_000_000_000
    """Time without data from which the sensor counts as silent, ns."""
    diagnostics: Out[DiagnosticArray]
    notice: Out[String]

    _line: SerialConnection[str] | None = None

    def connect(
        self, port: str, device: SerialDevice[str], open_session: Callable[[], S], text: SensorText
    ) -> None:
        """Begin to look for the sensor at a port, or at all of them."""
        self._open_session, self._text, self._port = open_session, text, port
        self.session: S | None = None
        self._received_ns, self._published = self.now_ns, 0
        self._problem, self._damaged = f"the {text.name} has not been found yet", 0
        self._missing = False
        self.announcement = (
            f"{text.name[0].upper()}{text.name[1:]}: looking for the {text.maker}, port {port}."
        )
        self._line = SerialConnection(port, device, self._posted_events())
        self._line.start()

    def _posted_events(self) -> ConnectionEvents[str]:
        """Return functions for the connection's thread, which post its events to the loop."""
        return ConnectionEvents(
            lambda path, _: self.post(lambda: self._on_open(path)),
            lambda data, at: self.post(lambda: self._on_data(data, at)),
            lambda reason: self.post(lambda: self._on_lost(reason)),
            lambda reason: self.post(lambda: self._on_missing(reason)),
        )

    def stop(self) -> None:
        """Send the last bytes and close the port."""
        super().stop()
        if self._line is not None:
            self._line.close(self.farewell())

    def farewell(self) -> bytes:
        """Return the bytes to send at the end; b"" for none."""
        return b""

    @abstractmethod
    def process(self, session: S, data: bytes, received_ns: int) -> None:
        """Decode bytes that were received at a time of the loop, and publish what is in them."""

    def note_published(self) -> None:
        """Note that a message was published."""
        self._received_ns = self.now_ns
        self._published += 1

    def fail(self, problem: str) -> None:
        """Report that the sensor is defective; its data are ignored until its port is opened again."""
        self._problem, self.session = problem, None

    @every(hz=20)
    def request(self) -> None:
        """Send the requests that are due; those that are lost with the connection are repeated after it."""
        if self._line is not None and self.session is not None:
            self._line.send(self.session.data_to_send(self.now_ns))

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the sensor sends data, and what was damaged on the line."""
        if self._line is None:
            return
        level, text = self._health()
        values = (
            KeyValue("driver", self._text.maker),
            KeyValue(self._text.name, "" if self.session is None else self.session.description),
            KeyValue(self._text.data, str(self._published)),
        )
        status = DiagnosticStatus(level, self._text.name, text, self._port, values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, self._text.frame), (status,)))

    def _health(self) -> tuple[int, str]:
        name, session = self._text.name, self.session
        damaged, self._damaged = (
            (0, 0) if session is None else (session.damaged - self._damaged, session.damaged)
        )
        silent_ns = self.now_ns - self._received_ns
        if self._problem:
            end = "" if self._problem.endswith("?") else "."
            return ERROR, f"{self._problem[0].upper()}{self._problem[1:]}{end}"
        if silent_ns > self.SILENCE_NS:
            return ERROR, f"The {name} has sent no {self._text.datum} for {silent_ns / 1e9:.0f} s."
        if damaged:
            return WARN, f"{damaged} packets of the {name} were damaged in the last second."
        return OK, f"The {name} sends {self._text.data}."

    # -- callbacks of the thread, run in the event loop

    def _on_open(self, path: str) -> None:
        self.session, self._damaged = self._open_session(), 0
        self._problem, self._missing = "", False
        self._port = path
        name = self._text.name
        self.notice.publish(String(f"{name[0].upper()}{name[1:]} at {path}."))

    def _on_data(self, data: bytes, at_ns: int) -> None:
        if self.session is not None:
            # time of reception on the loop's clock: subtract the delay since the thread read the bytes
            self.process(self.session, data, self.now_ns - max(0, wall_ns() - at_ns))

    def _on_lost(self, reason: str) -> None:
        self.notice.publish(String(f"{reason[0].upper()}{reason[1:]}; looking for it again."))
        self.fail(reason)
        self.publish_health()

    def _on_missing(self, reason: str) -> None:
        problem = f"no {self._text.name} found: {reason}"
        if not self._missing:
            self.notice.publish(String(f"{problem[0].upper()}{problem[1:]}."))
        self._missing, self._problem = True, problem

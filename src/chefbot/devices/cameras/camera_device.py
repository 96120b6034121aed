"""Common base of the drivers of cameras: a thread reads one, and opens it again after its cable was out."""

from __future__ import annotations

import threading
from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

from chefbot.devices.cameras.camera import CameraError, OpenCamera, TimedImage
from chefbot.errors import ScanError
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, Out, every

READ_TIMEOUT, RETRY_PERIOD, STOP_TIMEOUT = 0.2, 1.0, 5.0
"""Time to wait for one image, between two attempts to open the camera, and for an SDK to release it, s."""
SILENCE_NS = 2_000_000_000
"""Time without an image after which the camera is opened again, ns."""
MIN_PERIOD_SHARE = 0.75
"""Share of the period after which the next image is taken; a camera that is faster than the robot file skips some."""

I = TypeVar("I", bound=TimedImage)  # noqa: E741


class CameraDevice(Device, Generic[I]):
    """Base of a camera's driver.

    A thread opens and reads the camera. An image that the loop has no time for is replaced by the next. Subclasses
    call `connect` in `start`.
    """

    diagnostics: Out[DiagnosticArray]
    notice: Out[String]
    _thread: threading.Thread | None = None

    def connect(
        self, open_camera: Callable[[], OpenCamera[I]], rate: float, name: str, driver: str, frame: str
    ) -> None:
        """Begin to look for the camera. rate: of its images, Hz. name: in sentences. frame: of its images."""
        self._open, self._rate, self._what, self._driver, self._frame = open_camera, rate, name, driver, frame
        self._name, self._problem = "", "the camera has not been found yet"
        self._published, self._newest_ns = 0, 0
        self._images: deque[I] = deque(maxlen=1)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the stream and release the camera."""
        super().stop()
        if self._thread is not None:
            self._closing.set()
            self._thread.join(STOP_TIMEOUT)

    @abstractmethod
    def publish_image(self, image: I, header: Header) -> None:
        """Publish an image with its intrinsics. ScanError if they cannot be right."""

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the camera sends images."""
        if self._thread is None:
            return
        problem = self._problem
        text = f"{problem[0].upper()}{problem[1:]}." if problem else f"The {self._what} sends images."
        values = (KeyValue("driver", self._driver), KeyValue("images", str(self._published)))
        status = DiagnosticStatus(ERROR if problem else OK, self._what, text, self._name, values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, self._frame), (status,)))

    # -- in the loop

    def _on_open(self, name: str) -> None:
        self._name, self._problem = name, ""
        self.notice.publish(String(f"{self._what[0].upper()}{self._what[1:]}: {name}."))

    def _on_problem(self, reason: str) -> None:
        if reason != self._problem:
            self.notice.publish(String(f"Warning: {reason}; looking for the {self._what}."))
        self._problem = reason
        self.publish_health()

    def _publish(self) -> None:
        """Publish the newest image, stamped with the time of its exposure."""
        if not self._images:
            return  # an earlier call has published it
        image = self._images.pop()
        stamp_ns = self.now_ns - max(0, wall_ns() - image.taken_ns)
        if stamp_ns <= self._newest_ns:
            return
        try:
            self.publish_image(image, Header.of(stamp_ns, self._frame))
        except ScanError as error:
            self._on_problem(str(error))
            return
        self._newest_ns, self._published = stamp_ns, self._published + 1

    # -- in the thread

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                camera = self._open()
                try:
                    self.post(partial(self._on_open, camera.name))
                    self._read(camera)
                finally:
                    camera.close()
            except CameraError as error:
                self._fail(str(error))
            except Exception as error:  # an SDK may raise anything; the camera is opened again
                self._fail(f"the driver of the {self._what} failed: {type(error).__name__}: {error}")

    def _fail(self, reason: str) -> None:
        self.post(partial(self._on_problem, reason))
        self._closing.wait(RETRY_PERIOD)

    def _read(self, camera: OpenCamera[I]) -> None:
        """Read images until the node stops. CameraError if the camera sends none."""
        period_ns = MIN_PERIOD_SHARE * 1e9 / self._rate
        taken_ns, received_ns = 0, wall_ns()
        while not self._closing.is_set():
            image = camera.read(READ_TIMEOUT)
            if image is None:
                if wall_ns() - received_ns > SILENCE_NS:
                    raise CameraError(f"{camera.name} has sent no image for {SILENCE_NS // 1_000_000_000} s")
                continue
            received_ns = wall_ns()
            if image.taken_ns - taken_ns >= period_ns:
                taken_ns = image.taken_ns
                self._images.append(image)
                self.post(self._publish)

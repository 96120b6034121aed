"""The exact view of a simulated camera, rendered on the CPU by ray casting, and its colours."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.sensors import Camera
from chefbot.sim.cameras.capture import Capture
from chefbot.sim.cameras.depth_holes import draw_holes
from chefbot.sim.cameras.depth_raycast import draw
from chefbot.sim.cameras.shading import shade
from chefbot.sim.cameras.tag_faces import draw_tag
from chefbot.sim.world.shapes import MIRROR

F = TypeVar("F")


class Rendering(NamedTuple):
    """The exact view of a camera.

    depth: (h, w) metres along the optical axis, inf for none. number: (h, w) indices of the solids. mirrored: (h, w)
    whether a mirror reflects the pattern of light away, so that there is no depth; None where there is no mirror.
    """

    depth: NDArray[np.float32]
    number: NDArray[np.int32]
    mirrored: NDArray[np.bool_] | None = None


class PictureRenderer:
    """Renderer of one camera with an ideal lens."""

    def __init__(self, camera: Camera) -> None:
        self._size, self._focal = (camera.height, camera.width), camera.focal_length_px

    def render(self, capture: Capture) -> Rendering:
        """Render the exact view of a capture."""
        depth, number = np.empty(self._size, dtype=np.float32), np.empty(self._size, dtype=np.int32)
        kind, centre, half, yaw, _, material = capture.shapes
        position, rotation = capture.position, np.ascontiguousarray(capture.rotation)
        draw(kind, centre, half, yaw, position, rotation, self._focal, depth, number)
        if len(capture.holes):
            draw_holes(capture.holes, position, rotation, self._focal, depth, number)
        mirrored = None
        for mirror in np.flatnonzero(material == MIRROR).tolist():
            shows_it = number == mirror
            mirrored = shows_it if mirrored is None else mirrored | shows_it
        return Rendering(depth, number, mirrored)

    def render_rgb(self, capture: Capture, rendering: Rendering) -> NDArray[np.uint8]:
        """Return the colour image of a view, (h, w, 3)."""
        picture = np.empty((*rendering.depth.shape, 3), dtype=np.uint8)
        kind, centre, half, yaw, colour, _ = capture.shapes
        position, rotation = capture.position, np.ascontiguousarray(capture.rotation)
        depth, number = rendering.depth, rendering.number
        shade(kind, centre, half, yaw, colour, position, rotation, self._focal, depth, number, picture)
        for face in capture.tags:
            draw_tag(*face, position, rotation, self._focal, depth, picture)
        return picture

    def picture(self, capture: Capture) -> NDArray[np.uint8]:
        """Render the colour image of a capture, (h, w, 3)."""
        return self.render_rgb(capture, self.render(capture))


class RenderWorker(Generic[F]):
    """Renders images in a worker thread while the simulation goes on.

    An image is started at the time of its capture and fetched at the time of its delivery; the result depends only
    on what is rendered, never on the speed of the thread.
    """

    def __init__(self, name: str) -> None:
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix=name)
        self._started: list[Future[F]] = []

    def start(self, render: Callable[[], F]) -> None:
        """Start rendering an image; several may be pending."""
        self._started.append(self._pool.submit(render))

    def result(self) -> F:
        """Return the oldest pending image, waiting for it. Raises RuntimeError if none was started."""
        if not self._started:
            raise RuntimeError("no image has been started")
        return self._started.pop(0).result()

    def close(self) -> None:
        """Stop the thread; pending images are lost."""
        self._pool.shutdown(cancel_futures=True)

"""The robot's solids for the web UI's 3-D view, generated on the first request."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.requests import Request
from starlette.responses import Response

from chefbot.errors import ChefbotError
from chefbot.ui.files import SECURITY_HEADERS, Content

GLB = "model/gltf-binary"
"""The registered media type (https://www.iana.org/assignments/media-types/model/gltf-binary)."""


class SolidsEndpoint:
    """Calls `make` once, in a thread, so that neither startup nor the emergency stop waits for the CAD
    libraries."""

    def __init__(self, make: Callable[[], bytes] | None) -> None:
        self._make = make
        self._glb: Content | None = None
        self._lock = asyncio.Lock()

    async def serve(self, request: Request) -> Response:
        """Return the GLB; 404 without a robot, 500 and the error's sentence where its file is invalid."""
        if self._make is None:
            return Response("This web UI has no robot model.", 404, SECURITY_HEADERS, "text/plain")
        try:
            return (await self._get_glb(self._make)).response(request)
        except ChefbotError as error:
            return Response(str(error), 500, SECURITY_HEADERS, "text/plain")

    async def _get_glb(self, make: Callable[[], bytes]) -> Content:
        # Concurrent requests wait for the same generation.
        async with self._lock:
            if self._glb is None:
                self._glb = await asyncio.to_thread(lambda: Content(make(), GLB, SECURITY_HEADERS))
            return self._glb

"""The robot's solids for the page's 3-D view, made when they are first asked for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.requests import Request
from starlette.responses import Response

from chefbot.errors import UserError
from chefbot.ui.files import SAFE

GLB = "model/gltf-binary"
"""The registered media type (https://www.iana.org/assignments/media-types/model/gltf-binary)."""


class Solids:
    """Calls `make` once, in a thread, so that neither the start nor STOP waits for the CAD libraries."""

    def __init__(self, make: Callable[[], bytes] | None) -> None:
        self._make = make
        self._glb: bytes | None = None
        self._turn = asyncio.Lock()

    async def serve(self, _request: Request) -> Response:
        """The GLB; 404 where there is no robot, 500 and the sentence where its file describes an impossible one."""
        if self._make is None:
            return Response("This page shows no robot's solids.", 404, SAFE, "text/plain")
        try:
            return Response(await self._made(self._make), 200, SAFE, GLB)
        except UserError as error:
            return Response(str(error), 500, SAFE, "text/plain")

    async def _made(self, make: Callable[[], bytes]) -> bytes:
        async with self._turn:
            if self._glb is None:
                self._glb = await asyncio.to_thread(make)
            return self._glb

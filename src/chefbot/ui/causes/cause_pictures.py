"""Pictures of the moments in which a robot stopped or failed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import get_args

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from chefbot.errors import ChefbotError
from chefbot.storage.cause_records import CauseRecords, Picture
from chefbot.ui.access.roles import SEES_RECORDINGS, TITLES, may
from chefbot.ui.files import SECURITY_HEADERS, plain_text

TYPES: dict[Picture, str] = {"map": "image/png", "camera": "image/jpeg"}
HEADERS = SECURITY_HEADERS | {"cache-control": "private, max-age=600"}
"""A browser keeps a picture for ten minutes: the list is drawn again with every cause."""


class CausePictureEndpoint:
    """Serves the pictures of a history to managers: they may show people."""

    def __init__(self, history: Path | None) -> None:
        self._history = history

    async def serve(self, request: Request) -> Response:
        """Return a picture; 403 for guests and waiters, 404 if there is none."""
        if not may(request.state.visitor.role, SEES_RECORDINGS):
            return plain_text(
                f"Pictures of causes are shown with the link of {TITLES[SEES_RECORDINGS]} only.", 403
            )
        number, kind = request.path_params["number"], request.path_params["kind"]
        if kind not in get_args(Picture):
            return plain_text("No such picture.", 404)
        content = await run_in_threadpool(self._read, number, kind)
        return (
            Response(content, 200, HEADERS, TYPES[kind]) if content else plain_text("No such picture.", 404)
        )

    def _read(self, number: int, kind: Picture) -> bytes | None:
        if self._history is None or not self._history.exists() or number >= 1 << 63:
            return None
        try:
            with closing(CauseRecords(self._history)) as records:
                return records.picture(number, kind)
        except ChefbotError:  # damaged; the device has reported it already
            return None

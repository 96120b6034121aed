"""Downloads of incidents from the web UI."""

from __future__ import annotations

from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, Response

from chefbot.incidents.files import NAME
from chefbot.ui.access.roles import SEES_RECORDINGS, TITLES, may
from chefbot.ui.files import SECURITY_HEADERS, plain_text

MCAP = "application/octet-stream"


class IncidentEndpoint:
    """Serves the files of a folder to managers: an incident may contain pictures of people."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    async def serve(self, request: Request) -> Response:
        """Return a file as a download; 403 for guests and waiters, 404 if there is none of this name."""
        name = request.path_params["name"]
        if not may(request.state.visitor.role, SEES_RECORDINGS):
            return plain_text(
                f"Incidents can be downloaded with the link of {TITLES[SEES_RECORDINGS]} only.", 403
            )
        path = self._folder / name if self._folder is not None and NAME.match(name) else None
        if path is None or not path.is_file():
            return plain_text("No such incident.", 404)
        return FileResponse(path, headers=SECURITY_HEADERS, media_type=MCAP, filename=name)

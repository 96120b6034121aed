"""Device that opens a running robot's web UI: the counterpart of RViz in the book chapter."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from chefbot.runtime.node import Device
from chefbot.ui.browser import open_browser, url_for_view
from chefbot.ui.remote.web_ui_client import WebUiClient


class ViewerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the web UI's viewer."""

    page: Annotated[str, Meta(min_length=1, description="address of the running robot's web UI")]
    headless: Annotated[bool, Meta(description="only look whether a robot runs there")] = False
    view: Annotated[Literal["2d", "3d"], Meta(description="what the web UI shows first")] = "2d"


class ViewerDevice(Device):
    """Checks whether a robot runs at an address, opens the browser and is done."""

    params: ViewerParams

    def start(self) -> None:
        """Connect and open the browser; UserError if no robot runs there."""
        WebUiClient(self.params.page).close()
        address = url_for_view(self.params.page, self.params.view)
        opened = not self.params.headless and open_browser(address)
        self.announcement = f"{'Opened' if opened else 'A robot runs at'} {address}"

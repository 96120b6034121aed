"""Parameters of the web UI."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

HostName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9.-]{1,253}$")]


class WebUiParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the web UI's server."""

    port: Annotated[int, Meta(ge=1, le=65535, description="TCP port; the next free one if it is taken")] = (
        8080
    )
    host: Annotated[str, Meta(description="address to serve on; any but loopback asks for a token")] = (
        "127.0.0.1"
    )
    simulation: Annotated[bool, Meta(description="whether to offer boxes, doors and kidnapping")] = False
    names: Annotated[
        list[HostName],
        Meta(description="host names at which a reverse proxy serves it by https, as [robot.example.org]"),
    ] = []
    certificate: Annotated[
        str,
        Meta(
            description="for https: `fleet` for this machine's certificate, or a PEM file with its .key beside it"
        ),
    ] = ""
    kiosk_pin: Annotated[
        str,
        Meta(
            pattern=r"^([0-9]{4,8})?$",
            description="digits that end the view #kiosk on the robot's screen; empty: none",
            extra={"secret": True},
        ),
    ] = ""
    save_failures: Annotated[
        bool, Meta(description="whether a built robot saves the last minute after a failure")
    ] = True
    view: Annotated[Literal["2d", "3d"], Meta(description="what the printed address opens first")] = "2d"

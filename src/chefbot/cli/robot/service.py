"""`chefbot robot service`: a systemd unit for a built robot."""

from __future__ import annotations

import getpass
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from chefbot.launcher.service_unit import service_unit
from chefbot.storage.atomic_files import make_folder, write_atomic

console = Console(highlight=False, soft_wrap=True)


def run_service(launch: str, arguments: Sequence[str], user: str, out: Path) -> None:
    """Write the unit file, and print how to install it."""
    unit = service_unit(launch, arguments, user or getpass.getuser(), out)
    make_folder(out.parent)
    write_atomic(out, unit.encode())
    console.print(f"wrote {out}", markup=False)
    console.print(
        f"Install it as root: cp {out} /etc/systemd/system/ && systemctl daemon-reload && "
        f"systemctl enable --now {out.stem}",
        markup=False,
    )

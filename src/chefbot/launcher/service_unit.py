"""The systemd unit that starts the launch of a built robot with its computer, and again when it crashes or hangs."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from chefbot.errors import UserError
from chefbot.launcher.launch_changer import parse_arguments
from chefbot.runtime.launch import built_in_launches, find_launch, load_launch
from chefbot.supervision.restart_delay import MAX_RESTART_DELAY, MIN_RESTART_DELAY
from chefbot.supervision.service_manager import WATCHDOG_TIMEOUT
from chefbot.supervision.supervised_launch import END_TIMEOUT, START_TIMEOUT, USER_ERROR

RESTART_STEPS = 5
"""Number of restarts in a row over which the delay grows to its maximum."""
UNIT = """\
# Written by `chefbot robot service`; install it as root:
#   cp {file} /etc/systemd/system/ && systemctl daemon-reload && systemctl enable --now {name}
[Unit]
Description=chefbot launch {launch}
After=network.target
StartLimitIntervalSec=0

[Service]
Type=notify
User={user}
WorkingDirectory={folder}
Environment=PYTHONUNBUFFERED=1
ExecStart={command}
TimeoutStartSec={start_timeout:.0f}
WatchdogSec={watchdog:.0f}
WatchdogSignal=SIGKILL
Restart=on-failure
RestartPreventExitStatus={user_error}
RestartSec={min_delay:g}
RestartSteps={steps}
RestartMaxDelaySec={max_delay:.0f}
KillSignal=SIGINT
TimeoutStopSec={stop_timeout:.0f}

[Install]
WantedBy=multi-user.target
"""


def service_unit(launch: str, texts: Sequence[str], user: str, file: Path) -> str:
    """Return the text of the unit for a launch with its arguments; UserError if it could not be started.

    Paths in the arguments are made absolute. `user`: name of the user that it runs as. `file`: of the unit.
    """
    arguments = parse_arguments(texts)
    loaded = load_launch(launch, arguments)
    if loaded.clock == "simulation":
        raise UserError(f"launch {loaded.name} simulates a robot; a service is for a built one")
    name = launch if launch in built_in_launches() else str(find_launch(launch).resolve())
    given = [f"{key}:={_absolute(value)}" for key, value in arguments.items()]
    return UNIT.format(
        file=file,
        name=file.stem,
        launch=loaded.name,
        user=user,
        folder=Path.cwd(),
        command=" ".join(map(_quoted, [sys.executable, "-m", "chefbot", "launch", name, *given])),
        start_timeout=START_TIMEOUT,
        watchdog=WATCHDOG_TIMEOUT,
        user_error=USER_ERROR,
        min_delay=MIN_RESTART_DELAY,
        steps=RESTART_STEPS,
        max_delay=MAX_RESTART_DELAY,
        stop_timeout=END_TIMEOUT,
    )


def _absolute(value: str) -> str:
    return str(Path(value).resolve()) if os.sep in value and Path(value).exists() else value


def _quoted(word: str) -> str:
    """Quote a word of ExecStart (systemd.service(5)); '%' and '$' would be replaced there."""
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"' if escaped != word or " " in word or not word else word

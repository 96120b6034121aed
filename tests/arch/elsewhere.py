"""Runs chefbot as on Windows or a Mac: `python elsewhere.py import` and `python elsewhere.py launch ARGUMENTS`.

Our modules, and only they, get neither the Unix modules nor what `os` and `signal` have on Unix only. Libraries
keep them: they have their own ways on other systems.
"""

from __future__ import annotations

import builtins
import importlib
import os
import pkgutil
import signal
import sys
import types
from typing import Any

MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
OS = (
    "fork forkpty getuid geteuid getgid getegid getgroups getpgid getpgrp setsid killpg tcgetpgrp tcsetpgrp "
    "sched_getaffinity sched_setaffinity sched_yield nice openpty mkfifo posix_fallocate pread pwrite statvfs uname "
    "sysconf getloadavg fchmod fchown chown lchown O_NONBLOCK O_CLOEXEC O_NOCTTY O_DIRECTORY WNOHANG"
)
SIGNALS = (
    "SIGKILL SIGHUP SIGCONT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGALRM SIGPIPE SIGCHLD SIGQUIT setitimer pause"
)
_import = builtins.__import__


def _poorer(module: types.ModuleType, missing: str) -> types.ModuleType:
    """The module without some of its names."""
    gone = set(missing.split())
    poorer = types.ModuleType(module.__name__)
    vars(poorer).update({name: value for name, value in vars(module).items() if name not in gone})
    return poorer


POORER = {"os": _poorer(os, OS), "signal": _poorer(signal, SIGNALS), "sys": _poorer(sys, "")}
POORER["sys"].platform = "elsewhere"  # type: ignore[attr-defined]

SDK_MODULES = {f"chefbot.devices.cameras.{driver}" for driver in ("realsense", "oak", "orbbec")}
"""Modules that are imported only by a robot with such a camera, as they need the SDK of its maker."""


def _import_elsewhere(name: str, *rest: Any, **named: Any) -> types.ModuleType:
    """`rest`: globals, locals, fromlist and level, as Python passes them for an import statement."""
    importer = (rest[0] if rest else named.get("globals")) or {}
    if str(importer.get("__name__", "")).partition(".")[0] == "chefbot":
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        if name in POORER:
            return POORER[name]
    return _import(name, *rest, **named)


def import_all() -> int:
    """Each module of chefbot; how many there are."""
    import chefbot

    found = [one.name for one in pkgutil.walk_packages(chefbot.__path__, "chefbot.")]
    for name in found:
        if name not in SDK_MODULES and not name.endswith("__main__"):
            importlib.import_module(name)
    return len(found)


if __name__ == "__main__":
    builtins.__import__ = _import_elsewhere
    if sys.argv[1] == "import":
        sys.stdout.write(f"{import_all()}\n")
    else:
        from chefbot.cli.app import main

        main()

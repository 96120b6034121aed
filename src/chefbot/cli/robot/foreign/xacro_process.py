"""Expansion of an untrusted xacro file by a confined process, which gets its files from this one.

Each message is a line of JSON; some are followed by bytes, whose number it has. The process requests `read`, `find`
or `match`, and ends with `urdf` or `fail`.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

from chefbot.cli.robot.foreign.confinement import child_environment
from chefbot.cli.robot.foreign.xacro_files import FileKind, Files, PackageFiles
from chefbot.errors import ChefbotError, UserError

EXPANSION_SECONDS, CPU_SECONDS = 20.0, 10
"""Limits of the time of a whole expansion, and of its computing."""
EXPANSION_BYTES = 400_000_000
"""Limit of the memory that an expansion may allocate: a recursive macro would otherwise exhaust it."""
MAX_URDF_BYTES, MAX_LINE_BYTES, MAX_SENTENCE = 50_000_000, 100_000, 300
CHILD = "chefbot.cli.robot.foreign.xacro_child"
"""Module of the process. It is run with -P, so that a file xacro.py in the current folder is not imported."""


def expand(path: Path) -> bytes:
    """Return the URDF of a xacro file. Raises UserError with the reason if it cannot be expanded."""
    if find_spec("xacro") is None:
        raise UserError(f"robot description {path} is xacro, which is not installed; `pip install xacro`")
    with _started() as (process, pipes):
        _send(pipes[0], {"path": str(path), "memory": EXPANSION_BYTES, "cpu": CPU_SECONDS})
        try:
            return _served(*pipes, PackageFiles(path))
        except _FailedError as error:
            raise UserError(f"robot description {path}: xacro cannot expand it: {error}") from None
        except (OSError, ValueError, KeyError, EOFError):
            code = process.wait()
    if code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", 0)):
        raise UserError(
            f"robot description {path}: xacro had not finished after {EXPANSION_SECONDS:g} s,"
            f" or {CPU_SECONDS} s of computing"
        )
    raise UserError(f"robot description {path}: xacro cannot expand it: it crashed (exit code {code})")


class _FailedError(ChefbotError):
    """The process has reported why it cannot expand the file."""


@contextmanager
def _started() -> Iterator[tuple[subprocess.Popen[bytes], tuple[IO[bytes], IO[bytes]]]]:
    """Run the process with its input and output; it is ended with the block, or when its time is over."""
    with subprocess.Popen(
        [sys.executable, "-P", "-m", CHILD],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=child_environment(),
    ) as process:  # fmt: skip
        assert process.stdin is not None and process.stdout is not None
        timer = threading.Timer(EXPANSION_SECONDS, process.kill)
        timer.start()
        try:
            yield process, (process.stdin, process.stdout)
        finally:
            timer.cancel()
            process.kill()
            with suppress(OSError):
                process.stdin.close()


def _served(to: IO[bytes], source: IO[bytes], files: Files) -> bytes:
    """Answer the process's questions until it has the URDF. Raises _FailedError, or EOFError if it has ended."""
    while True:
        request = json.loads(_line(source))
        if "fail" in request:
            raise _FailedError(" ".join(str(request["fail"]).split())[:MAX_SENTENCE] or "it crashed")
        if "urdf" in request:
            if int(request["urdf"]) > MAX_URDF_BYTES:
                raise _FailedError(f"the result is longer than {MAX_URDF_BYTES} bytes")
            return source.read(int(request["urdf"]))
        _send(to, *_answer(request, files))


def _line(source: IO[bytes]) -> bytes:
    line = source.readline(MAX_LINE_BYTES)
    if not line.endswith(b"\n"):
        raise EOFError
    return line


def _answer(request: dict[str, Any], files: Files) -> tuple[dict[str, Any], bytes]:
    """Return the answer to a question, and the bytes that follow it."""
    try:
        if "read" in request:
            kind: FileKind = "YAML file" if request.get("kind") == "YAML file" else "robot description"
            file = files.read(str(request["read"]), kind)
            return {"value": file.path, "bytes": len(file.data)}, file.data
        if "find" in request:
            return {"value": files.find(str(request["find"]))}, b""
        return {"value": files.match(str(request["match"]))}, b""
    except FileNotFoundError as error:
        return {"missing": str(error)}, b""
    except (ChefbotError, OSError, ValueError) as error:
        return {"error": str(error)}, b""


def _send(to: IO[bytes], message: dict[str, Any], data: bytes = b"") -> None:
    to.write(json.dumps(message).encode() + b"\n" + data)
    to.flush()

"""The compiled firmware on a pty, and a cable to it that can be pulled, plugged in elsewhere, and disturbed."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
import tty
from pathlib import Path

from tests.support.waiting import PATIENCE

from chefbot.board.framing import LineSplitter
from chefbot.board.messages import BoardLine, parse

SERVE = """
import sys
from pathlib import Path
from chefbot.robot.load import load_robot
from chefbot.sim.firmware import serve
sys.exit(serve(load_robot(sys.argv[1]), Path(sys.argv[2])))
"""


class Emulator:
    """The firmware's program; `inject` is what can happen to a board."""

    def __init__(self, folder: Path, robot: str = "chefbot") -> None:
        self.path = folder / "emulated"
        command = [sys.executable, "-c", SERVE, robot, str(self.path)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        assert self._process.stdout.readline().strip() == str(self.path)

    def inject(self, event: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(event + "\n")
        self._process.stdin.flush()

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(PATIENCE)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()


class Cable:
    """Between a board and a path; `lines` is what the board sends, `sent` what is sent to it."""

    def __init__(self, board: Path, path: Path) -> None:
        self._board = os.open(board, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._board)
        self.path = path
        self.lines: list[BoardLine] = []
        self.sent = b""
        self._splitter = LineSplitter()
        self._ends: tuple[int, int] | None = None
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def plug(self) -> None:
        """A new device file each time, as USB gives one."""
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(theirs))
        with self._lock:
            self._ends = ours, theirs

    def pull(self) -> None:
        """The device file is gone, and whoever had it open learns it."""
        self.path.unlink()
        with self._lock:
            assert self._ends is not None
            for end in self._ends:
                os.close(end)
            self._ends = None

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        if self._ends is not None:
            self.pull()
        os.close(self._board)

    def __enter__(self) -> Cable:
        self.plug()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def newest(self, kind: type) -> BoardLine | None:
        return next((line for line in reversed(self.lines) if isinstance(line, kind)), None)

    def since(self, count: int, kind: type) -> list[BoardLine]:
        """Lines of a kind behind the first `count` lines."""
        return [line for line in self.lines[count:] if isinstance(line, kind)]

    def _pump(self) -> None:
        while not self._ending.is_set():
            with self._lock:
                ours = self._ends[0] if self._ends else None
                if ours is not None:
                    self._down(ours)
            ready, _, _ = select.select([self._board], [], [], 0.002)
            if not ready:
                continue
            data = os.read(self._board, 4096)
            self.lines += [line for raw in self._splitter.push(data) if (line := parse(raw)) is not None]
            with self._lock:
                if self._ends is not None:
                    self._up(data)

    def _down(self, ours: int) -> None:
        try:
            data = os.read(ours, 4096)
        except BlockingIOError:
            return
        self.sent += data
        os.write(self._board, data)

    def _up(self, data: bytes) -> None:
        assert self._ends is not None
        try:
            os.write(self._ends[0], data)
        except BlockingIOError:
            return  # nobody reads: what does not fit is lost, as on a wire

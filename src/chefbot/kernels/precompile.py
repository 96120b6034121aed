"""Kernels are compiled once after an installation; this shows it instead of letting the robot stall.

Worker processes compile the groups of `kernels` into Numba's cache, from which this process loads them. What
they compile is only ever a cache: results are the same without it, and two that compile at once do no harm.
"""

from __future__ import annotations

import atexit
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from chefbot.errors import UserError
from chefbot.kernels import cache_stamp
from chefbot.kernels.groups import FIRST, GROUPS
from chefbot.ui import layers
from chefbot.ui.browser import open_browser
from chefbot.ui.commands import Command
from chefbot.ui.server import PageServer

Show = Callable[[layers.Progress], None]
MOST_WORKERS = 4
"""More would wait for the longest group."""
LOOK = 0.2
"""Seconds between two looks at the workers."""


class Warming:
    """The compilation under way. `page_opened`: a browser already looks at the demo's address."""

    def __init__(self, console: Console, groups: Sequence[str]) -> None:
        self._console = console
        self._wanted = list(groups)
        self._todo: queue.SimpleQueue[str] = queue.SimpleQueue()
        for group in groups:
            self._todo.put(group)
        self._done: set[str] = set()
        self._files: set[str] = set()
        self._lock = threading.Lock()
        self._workers: list[threading.Thread] = []
        self.page_opened = False

    def start(self) -> None:
        """Begin, one worker a core."""
        for _ in range(min(os.cpu_count() or 1, MOST_WORKERS, len(self._wanted))):
            worker = threading.Thread(target=self._feed, name="kernel compiler", daemon=True)
            self._workers.append(worker)
            worker.start()

    @property
    def busy(self) -> bool:
        """Whether something is still to be compiled."""
        return self._waits_for(self._wanted)

    def wait(self, groups: Sequence[str] = (), show: Show = lambda _: None) -> None:
        """Until these groups, or all, are compiled; `show` is told how far it is."""
        missing = [group for group in self._wanted if not groups or group in groups]
        if not self._waits_for(missing):
            return
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        with Progress(*columns, console=self._console, transient=True) as bar:
            task = bar.add_task("compiling kernels", total=len(self._wanted))
            while self._waits_for(missing):
                bar.update(task, description=self._sentence(), completed=len(self._done))
                show(layers.Progress(text=self._sentence(), done=len(self._done), total=len(self._wanted)))
                time.sleep(LOOK)
        show(layers.Progress(text=self._sentence(), done=len(self._done), total=len(self._wanted)))

    def _waits_for(self, groups: Sequence[str]) -> bool:
        return not self._done.issuperset(groups) and any(worker.is_alive() for worker in self._workers)

    def _sentence(self) -> str:
        left = [group for group in self._wanted if group not in self._done]
        return f"Compiling kernels, once after an installation: {left[0]}" if left else "Kernels are compiled"

    def _feed(self) -> None:
        """Give one worker process one group after the other."""
        try:
            with _worker() as ask:
                while not self._todo.empty():
                    group = self._todo.get_nowait()
                    files = ask(group)
                    self._take(group, files)
        except queue.Empty:
            return  # another worker was faster
        except (OSError, RuntimeError) as error:
            self._console.print(f"Some kernels compile only when they are needed: {error}")

    def _take(self, group: str, files: list[str]) -> None:
        """One group less; the last one is noted down for the next start."""
        with self._lock:
            self._files.update(files)
            if {*self._done, group}.issuperset(self._wanted):
                remember(self._console, self._files)
            self._done.add(group)  # last: who waits may go on now


@contextmanager
def _worker() -> Iterator[Callable[[str], list[str]]]:
    """A process that compiles a group and tells the files; it ends with us, however we end."""
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "chefbot.kernels.groups"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
        atexit.register(process.kill)
        assert process.stdin is not None and process.stdout is not None
        asked, answers = process.stdin, process.stdout

        def ask(group: str) -> list[str]:
            asked.write(group + "\n")
            asked.flush()
            answer = answers.readline()
            if not answer:
                errors.seek(0)
                last = errors.read().strip().rpartition("\n")[2]
                raise RuntimeError(f"compiling {group} ended with: {last}")
            files: list[str] = json.loads(answer)
            return files

        try:
            yield ask
        finally:
            asked.close()
            process.wait()
            answers.close()
            atexit.unregister(process.kill)


def remember(console: Console, files: set[str]) -> None:
    """So that the next start need not ask."""
    try:
        cache_stamp.write_stamp(cache_stamp.stamp_path(), files)
    except OSError as error:
        console.print(f"It cannot be remembered that kernels are compiled: {error}")


def start_warming(console: Console, port: int | None = None) -> Warming:
    """Compile what is not in the cache yet; returns as soon as the first picture can come.

    With `port`, a page there shows the progress until then. `wait()` for the rest before the robot thinks.
    """
    cold = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0" and not cache_stamp.all_there(
        cache_stamp.stamp_path()
    )
    warming = Warming(console, tuple(GROUPS) if cold else ())
    if not cold:
        return warming
    warming.start()
    if port is None:
        warming.wait(FIRST)
    else:
        _wait_with_page(console, warming, port)
    return warming


def _wait_with_page(console: Console, warming: Warming, port: int) -> None:
    page = PageServer(port, "127.0.0.1", _not_yet)
    url = page.start()
    console.print(f"The operator's page: [bold]{url}[/]")
    warming.page_opened = open_browser(url)
    try:
        warming.wait(FIRST, lambda progress: page.show("progress", progress))
    finally:
        page.stop()


def _not_yet(_: Command) -> None:
    raise UserError("The robot has not started yet; kernels are being compiled")


def warm_kernels(console: Console, port: int | None = None) -> None:
    """Compile what is not in the cache yet, and wait for all of it."""
    start_warming(console, port).wait()

"""Compilation of the kernels, once after an installation or a change of the code, with a progress display.

Otherwise the robot would stall at first use. Worker processes compile the groups of `kernels` into Numba's
cache, from which this process loads them. It is only a cache: results are the same without it, and two that
compile at once do no harm.
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
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from chefbot.errors import UserError
from chefbot.kernels import cache_stamp
from chefbot.kernels.groups import DEMO_GROUPS, FIRST_PICTURE_GROUPS, groups_of
from chefbot.ui.browser import open_browser
from chefbot.ui.commands import OperatorCommand
from chefbot.ui.display import views
from chefbot.ui.server import WebUiServer

Show = Callable[[views.ProgressView], None]
MAX_WORKERS = 4
"""Maximum number of workers; more would wait for the longest group."""
POLL_PERIOD = 0.2
"""Period of the progress updates, s."""


class KernelCompilation:
    """A compilation in progress; `page_opened`: whether a browser already shows the demo's address."""

    def __init__(self, console: Console, groups: Sequence[str], stamp: Path | None = None) -> None:
        """stamp: written once all groups are compiled; by default that of the demo's kernels."""
        self._console, self._stamp = console, stamp or cache_stamp.stamp_path()
        self._groups = list(groups)
        self._queue: queue.SimpleQueue[str] = queue.SimpleQueue()
        for group in groups:
            self._queue.put(group)
        self._done: set[str] = set()
        self._files: set[str] = set()
        self._lock = threading.Lock()
        self._workers: list[threading.Thread] = []
        self._announced, self._printed = False, 0
        self.page_opened = False

    def start(self) -> None:
        """Start the workers, at most one per core."""
        for _ in range(min(os.cpu_count() or 1, MAX_WORKERS, len(self._groups))):
            worker = threading.Thread(target=self._run_worker, name="kernel compiler", daemon=True)
            self._workers.append(worker)
            worker.start()

    @property
    def busy(self) -> bool:
        """Whether something is still to be compiled."""
        return self._is_compiling(self._groups)

    def wait(self, groups: Sequence[str] = (), show: Show = lambda _: None) -> None:
        """Wait until these groups, or all, are compiled; `show` is called with the progress."""
        missing = [group for group in self._groups if not groups or group in groups]
        if not self._is_compiling(missing):
            return
        if not self._console.is_terminal and not self._announced:  # where no bar is shown
            self._announced = True
            self._console.print(
                "Compiling kernels, as after each installation or change: this takes some minutes."
            )
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        with Progress(*columns, console=self._console, transient=True) as bar:
            task = bar.add_task("compiling kernels", total=len(self._groups))
            while self._is_compiling(missing):
                self._print_progress()
                bar.update(task, description=self._sentence(), completed=len(self._done))
                show(views.ProgressView(text=self._sentence(), done=len(self._done), total=len(self._groups)))
                time.sleep(POLL_PERIOD)
        show(views.ProgressView(text=self._sentence(), done=len(self._done), total=len(self._groups)))

    def _print_progress(self) -> None:
        """Print how many groups are compiled whenever another one is, where no bar is shown."""
        if not self._console.is_terminal and len(self._done) > self._printed:
            self._printed = len(self._done)
            self._console.print(f"  {self._printed} of {len(self._groups)} groups of kernels")

    def _is_compiling(self, groups: Sequence[str]) -> bool:
        return not self._done.issuperset(groups) and any(worker.is_alive() for worker in self._workers)

    def _sentence(self) -> str:
        remaining = [group for group in self._groups if group not in self._done]
        return f"Compiling kernels: {remaining[0]}" if remaining else "Kernels are compiled"

    def _run_worker(self) -> None:
        """Pass the groups to one worker process, one at a time."""
        try:
            with _worker() as compile_group:
                while not self._queue.empty():
                    group = self._queue.get_nowait()
                    files = compile_group(group)
                    self._store_result(group, files)
        except queue.Empty:
            return  # another worker was faster
        except (OSError, RuntimeError) as error:
            self._console.print(f"Some kernels will be compiled on first use: {error}")

    def _store_result(self, group: str, files: list[str]) -> None:
        """Record a compiled group; after the last one write the stamp for the next start."""
        with self._lock:
            self._files.update(files)
            if {*self._done, group}.issuperset(self._groups):
                record_stamp(self._console, self._files, self._stamp)
            self._done.add(group)  # last, as it releases those who wait


@contextmanager
def _worker() -> Iterator[Callable[[str], list[str]]]:
    """Yield a function that compiles a group in a worker process and returns its files.

    The worker exits with this process, however that exits.
    """
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
        requests, answers = process.stdin, process.stdout

        def compile_group(group: str) -> list[str]:
            requests.write(group + "\n")
            requests.flush()
            answer = answers.readline()
            if not answer:
                errors.seek(0)
                last_line = errors.read().strip().rpartition("\n")[2]
                raise RuntimeError(f"compiling {group} ended with: {last_line}")
            files: list[str] = json.loads(answer)
            return files

        try:
            yield compile_group
        finally:
            requests.close()
            process.wait()
            answers.close()
            atexit.unregister(process.kill)


def record_stamp(console: Console, files: set[str], stamp: Path) -> None:
    """Write the stamp, so that the next start need not check the cache."""
    try:
        cache_stamp.write_stamp(stamp, files)
    except OSError as error:
        console.print(f"Cannot record that the kernels are compiled: {error}")


def start_compilation(console: Console, port: int | None = None) -> KernelCompilation:
    """Compile what is not in the cache yet; return as soon as the first picture can be computed.

    With `port`, the web UI shows the progress there until then. Call `wait()` for the remaining groups before
    the algorithms run.
    """
    is_cold = _is_cold(cache_stamp.stamp_path())
    warming = KernelCompilation(console, DEMO_GROUPS if is_cold else ())
    if not is_cold:
        return warming
    warming.start()
    if port is None:
        warming.wait(FIRST_PICTURE_GROUPS)
    else:
        _wait_with_web_ui(console, warming, port)
    return warming


def _wait_with_web_ui(console: Console, warming: KernelCompilation, port: int) -> None:
    page = WebUiServer(port, "127.0.0.1", _reject_command)
    url = page.start()
    console.print(f"Web UI: [bold]{url}[/]")
    warming.page_opened = open_browser(url)
    try:
        warming.wait(FIRST_PICTURE_GROUPS, lambda progress: page.set_layer("progress", progress))
    finally:
        page.stop()


def _reject_command(_: OperatorCommand, __: str) -> None:
    raise UserError("The robot has not started yet; kernels are being compiled")


def _is_cold(stamp: Path) -> bool:
    """Return whether kernels are to be compiled."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") == "0" and not cache_stamp.is_complete(stamp)


def compile_kernels(console: Console, port: int | None = None, kinds: Collection[str] = ()) -> None:
    """Compile what is not in the cache yet, and wait for all of it.

    kinds: classes of nodes that the demo does not have, but this launch.
    """
    start_compilation(console, port).wait()
    _compile_groups(console, [group for group in groups_of(kinds) if group not in DEMO_GROUPS])


def compile_kernels_of(console: Console, kinds: Collection[str]) -> None:
    """Compile what nodes of these classes run, but nothing that only others of the demo run."""
    demo_is_compiled = not _is_cold(cache_stamp.stamp_path())
    _compile_groups(
        console, [group for group in groups_of(kinds) if not (demo_is_compiled and group in DEMO_GROUPS)]
    )


def _compile_groups(console: Console, groups: Sequence[str]) -> None:
    """Compile those of the groups that are not in the cache yet, one after the other."""
    for group in groups:
        stamp = cache_stamp.stamp_path(group)
        if _is_cold(stamp):
            further = KernelCompilation(console, (group,), stamp)
            further.start()
            further.wait()

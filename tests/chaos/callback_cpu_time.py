"""CPU time of the callbacks of a loop, without the time in which Numba compiles their kernels or loads them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher

from chefbot.runtime import loop as loop_module
from chefbot.runtime.loop import CallbackStatistics, Loop


class _ThreadClock:
    """CPU time of this thread, ns, which stands still while a kernel is compiled or loaded."""

    def __init__(self) -> None:
        self._compile_ns = self._depth = 0
        self._compile = Dispatcher._compile_for_args

    def read(self) -> int:
        """Return the CPU time, ns."""
        return time.thread_time_ns() - self._compile_ns

    def compile_for_args(self, dispatcher: Any, *args: Any, **kwargs: Any) -> Any:
        """Compile a kernel, or load it from its cache; kernels that it calls are compiled within."""
        begin = time.thread_time_ns()
        self._depth += 1
        try:
            return self._compile(dispatcher, *args, **kwargs)
        finally:
            self._depth -= 1
            if not self._depth:
                self._compile_ns += time.thread_time_ns() - begin


@contextmanager
def callbacks_measured_in_cpu_time() -> Iterator[None]:
    """Let the statistics of all loops count CPU time of their thread instead of wall time."""
    clock = _ThreadClock()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop_module, "wall_ns", clock.read)
        patch.setattr(
            Dispatcher, "_compile_for_args", lambda *args, **kwargs: clock.compile_for_args(*args, **kwargs)
        )
        yield


def is_of_the_robot(timing: CallbackStatistics) -> bool:
    """Return whether the callback is one of the robot's software, not of the simulator or of no node."""
    return timing.owner not in ("", "simulator")


def worst_callbacks(loop: Loop, count: int) -> dict[str, float]:
    """Return the longest CPU time of the `count` slowest callbacks of the robot's nodes by name, ms."""
    ours = [timing for timing in loop.timings.values() if is_of_the_robot(timing)]
    slowest = sorted(ours, key=lambda timing: -timing.worst_ns)[:count]
    return {timing.name: round(timing.worst_ns / 1e6, 2) for timing in slowest}

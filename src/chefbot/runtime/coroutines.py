"""Coroutines on the event loop: `await` a result or a delay.

They use neither threads nor asyncio, so the order of execution is deterministic.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Cancelled(Exception):  # noqa: N818 (it is not an error)
    """Raised in a task at its `await` when the task is cancelled."""


class Future(Generic[T]):
    """A value that will be available later; a task that awaits it resumes at the instant it is set."""

    def __init__(self, on_cancel: Callable[[], None] | None = None) -> None:
        self.done = False
        self._value: T | None = None
        self._error: BaseException | None = None
        self._waiters: list[Callable[[], None]] = []
        self._on_cancel = on_cancel

    def set_result(self, value: T) -> None:
        """Set the value and resume all waiting tasks at once."""
        self._finish(value, None)

    def set_exception(self, error: BaseException) -> None:
        """Set the exception and raise it in all waiting tasks."""
        self._finish(None, error)

    def discard(self) -> None:
        """Drop all waiters and notify the producer of the value that it is no longer needed."""
        if not self.done and self._on_cancel is not None:
            self._on_cancel()
        self._waiters.clear()

    def result(self) -> T:
        """Return the value, or raise the exception that was set."""
        if self._error is not None:
            raise self._error
        return self._value  # type: ignore[return-value]

    def add_done_callback(self, waiter: Callable[[], None]) -> None:
        """Call `waiter` when the future is done, at once if it already is."""
        if self.done:
            waiter()
        else:
            self._waiters.append(waiter)

    def _finish(self, value: T | None, error: BaseException | None) -> None:
        if self.done:
            return
        self.done, self._value, self._error = True, value, error
        waiters, self._waiters = self._waiters, []
        for waiter in waiters:
            waiter()

    def __await__(self) -> Generator[Future[Any], None, T]:
        if not self.done:
            yield self
        return self.result()


def wait_any(*futures: Future[Any]) -> Future[None]:
    """Return a future that is done when one of `futures` is; abandoning it abandons all of them."""

    def abandon_all() -> None:
        for future in futures:
            future.discard()

    first: Future[None] = Future(on_cancel=abandon_all)
    for future in futures:
        future.add_done_callback(lambda: first.set_result(None))
    return first


class Task(Future[T]):
    """A running coroutine, and the future of its return value.

    An exception that the coroutine raises fails the future. It is also raised in the callback that resumed
    the task, which thus counts as the faulty one.
    """

    def __init__(self, work: Coroutine[Any, Any, T]) -> None:
        super().__init__()
        self._work = work
        self._awaited: Future[Any] | None = None

    def start(self) -> Task[T]:
        """Run the coroutine until its first `await`."""
        self._advance(None)
        return self

    def cancel(self) -> None:
        """Raise Cancelled in the coroutine at the `await` where it is suspended."""
        if self.done:
            return
        awaited, self._awaited = self._awaited, None
        if awaited is not None:
            awaited.discard()
        self._advance(Cancelled())

    def _advance(self, error: BaseException | None) -> None:
        try:
            awaited = self._work.send(None) if error is None else self._work.throw(error)
        except StopIteration as stop:
            self.set_result(stop.value)
        except Cancelled as cancelled:
            self.set_exception(cancelled)
        except Exception as exception:
            self.set_exception(exception)  # release the waiting tasks, they would wait forever
            raise
        else:
            self._awaited = awaited
            awaited.add_done_callback(lambda: self._resume(awaited))

    def _resume(self, awaited: Future[Any]) -> None:
        if self._awaited is awaited:  # else the task was cancelled in the meantime
            self._awaited = None
            self._advance(None)

"""Coroutines on the loop: `await` a result or a delay. No threads, no asyncio, so the order is ours."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Cancelled(Exception):  # noqa: N818 (it is no error)
    """Thrown into a task at its `await` when it is told to give up."""


class Future(Generic[T]):
    """A value to come. `await` it in a task; it resumes at the instant that the value is set."""

    def __init__(self, on_cancel: Callable[[], None] | None = None) -> None:
        self.done = False
        self._value: T | None = None
        self._error: BaseException | None = None
        self._waiters: list[Callable[[], None]] = []
        self._on_cancel = on_cancel

    def set(self, value: T) -> None:
        """Give the value; those who wait go on at once."""
        self._finish(value, None)

    def fail(self, error: BaseException) -> None:
        """Raise `error` in those who wait."""
        self._finish(None, error)

    def abandon(self) -> None:
        """Nobody waits any more; whoever works for it is told so."""
        if not self.done and self._on_cancel is not None:
            self._on_cancel()
        self._waiters.clear()

    def result(self) -> T:
        """The value, or the error raised."""
        if self._error is not None:
            raise self._error
        return self._value  # type: ignore[return-value]

    def then(self, waiter: Callable[[], None]) -> None:
        """Call when done, at once if it is."""
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


def first_of(*futures: Future[Any]) -> Future[None]:
    """`await` it until one of them is done; giving up the wait gives them all up."""

    def abandon_all() -> None:
        for future in futures:
            future.abandon()

    first: Future[None] = Future(on_cancel=abandon_all)
    for future in futures:
        future.then(lambda: first.set(None))
    return first


class Task(Future[T]):
    """A running coroutine; also the future of what it returns.

    What it raises fails the future, and is raised in whoever resumed it as well: it is that callback's fault.
    """

    def __init__(self, work: Coroutine[Any, Any, T]) -> None:
        super().__init__()
        self._work = work
        self._waits_for: Future[Any] | None = None

    def start(self) -> Task[T]:
        """Run to the first `await`."""
        self._advance(None)
        return self

    def cancel(self) -> None:
        """Throw Cancelled in at the `await` where it stands."""
        if self.done:
            return
        waited, self._waits_for = self._waits_for, None
        if waited is not None:
            waited.abandon()
        self._advance(Cancelled())

    def _advance(self, error: BaseException | None) -> None:
        try:
            waited = self._work.send(None) if error is None else self._work.throw(error)
        except StopIteration as stop:
            self.set(stop.value)
        except Cancelled as cancelled:
            self.fail(cancelled)
        except Exception as fault:
            self.fail(fault)  # those who wait must not wait for ever
            raise
        else:
            self._waits_for = waited
            waited.then(lambda: self._resume(waited))

    def _resume(self, waited: Future[Any]) -> None:
        if self._waits_for is waited:  # else it was cancelled in between
            self._waits_for = None
            self._advance(None)

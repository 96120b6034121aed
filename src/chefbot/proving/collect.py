"""Submission of runs to a cluster, and collection of their results, whatever dies in between."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from chefbot.errors import ChefbotError
from chefbot.plural import number_of
from chefbot.proving.cluster import DaskCluster
from chefbot.proving.record import RunRecord
from chefbot.proving.run_spec import RunSpec
from chefbot.proving.worker import RunResult, make_run_in_process

MAX_ATTEMPTS = 20
"""Times that a run is submitted again after its result was lost."""
Collected = Callable[[RunRecord, bytes], None]


class LostRunError(ChefbotError):
    """A run whose result was lost repeatedly."""


def collect(cluster: DaskCluster, specs: Iterable[RunSpec], add: Collected) -> None:
    """Make all runs and call `add` once for each, as they end.

    A run whose worker dies is made again by the scheduler; when the connection to the scheduler is lost, runs without
    a result are submitted again. Raises UserError for a worker with other code, and LostRunError.
    """
    remaining = {spec.key: spec for spec in specs}
    attempts = 0
    while remaining:
        if attempts:
            cluster.connect()
        before = len(remaining)
        _collect_connected(cluster, remaining, add)
        attempts = 1 if len(remaining) < before else attempts + 1
        if attempts > MAX_ATTEMPTS:
            raise LostRunError(
                f"{number_of(len(remaining), 'run')} without a result after {MAX_ATTEMPTS} attempts; "
                f"check {cluster.address}"
            )


def _collect_connected(cluster: DaskCluster, remaining: dict[str, RunSpec], add: Collected) -> None:
    """Collect until all are done or the connection is lost; done ones are removed from `remaining`."""
    from distributed import as_completed
    from distributed.client import ClosedClientError

    futures: dict[str, Any] = {}
    try:
        futures.update((key, _submit(cluster.client, spec)) for key, spec in remaining.items())
        keys = {future.key: key for key, future in futures.items()}
        for future in as_completed(list(futures.values()), loop=cluster.client.loop):
            result = _result(future)
            if result is None:
                continue
            key = keys[future.key]
            add(msgspec.json.decode(result.record, type=RunRecord), result.log)
            del remaining[key], futures[key]
            future.release()
    except (OSError, TimeoutError, ClosedClientError):
        return  # the connection is lost
    finally:
        for future in futures.values():
            future.release()


def _submit(client: Any, spec: RunSpec) -> Any:
    """Submit a run under its own key, so that it is not made twice."""
    packed = msgspec.msgpack.encode(spec)
    return client.submit(make_run_in_process, packed, key=f"chefbot-run-{spec.key}", retries=0)


def _result(future: Any) -> RunResult | None:
    """Return the result of a run that has ended; None if it was lost with its worker or the connection."""
    from distributed import CancelledError, KilledWorker

    if future.status == "finished":
        try:
            result: RunResult = future.result(timeout="60s")
        except (CancelledError, TimeoutError, OSError):
            return None
        return result
    if future.status == "error":
        error = future.exception(timeout="60s")
        if not isinstance(error, KilledWorker):
            raise error
    return None

"""The Dask cluster that runs are made on: processes of this machine, or any scheduler by its address."""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from chefbot.errors import UserError
from chefbot.proving.run_spec import code_hash
from chefbot.proving.worker import dask_setup

ADDRESS = re.compile(r"(tcp|tls|ws|wss)://(\[[^\]]+\]|[^:/]+):\d{1,5}")
CONNECT_TIMEOUT = "15s"
REPLACE_PERIOD = 2.0
"""Period at which dead workers of this machine are looked for, s."""
LOST_WORKER_TIMEOUT = "4s"
"""Time after which a worker that did not come back is given up."""
ALLOWED_FAILURES = 1000
"""Deaths of workers that a run survives: each costs its time only."""


def check_address(address: str) -> None:
    """Raise UserError for an invalid address of a scheduler; an empty one stands for processes of this machine."""
    if address and not ADDRESS.fullmatch(address):
        raise UserError(f"--scheduler {address[:80]}: give an address as tcp://HOST:PORT")


@contextmanager
def cluster(address: str, workers: int) -> Iterator[DaskCluster]:
    """Yield a connection to the scheduler at `address`, or to `workers` processes started here if it is empty.

    Raises UserError without Dask, if the scheduler does not answer, or if a worker has other code.
    """
    check_address(address)
    try:
        import dask
        import distributed  # noqa: F401 - so that the advice covers it
    except ImportError:
        raise UserError("proving needs Dask and PyArrow: pip install 'chefbot[prove]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # deaths of workers are expected
    with dask.config.set(_dask_settings()):
        if address:
            yield from _connected(DaskCluster(address))
            return
        with _local_cluster(workers) as local, _dead_workers_replaced(local, workers):
            yield from _connected(DaskCluster(local.scheduler_address))


def _dask_settings() -> dict[str, object]:
    return {
        "distributed.scheduler.allowed-failures": ALLOWED_FAILURES,
        "distributed.comm.timeouts.connect": CONNECT_TIMEOUT,
        "distributed.deploy.lost-worker-timeout": LOST_WORKER_TIMEOUT,
        "distributed.admin.low-level-log-length": 0,
        "distributed.worker.use-file-locking": False,
    }


def _local_cluster(workers: int) -> Any:
    from distributed import LocalCluster

    try:
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=None,
            dashboard_address=None,
            # Without a dashboard Dask still serves port 8787, of which there is one for all proofs of a machine
            scheduler_kwargs={"dashboard": False, "dashboard_address": "localhost:0"},
            silence_logs=logging.CRITICAL,
            preload=[dask_setup.__module__],
        )
    except (OSError, RuntimeError) as error:
        raise UserError(f"the {workers} workers could not be started: {error}") from None


@contextmanager
def _dead_workers_replaced(local: Any, workers: int) -> Iterator[None]:
    """Replace dead workers in the background: Dask does not restart one that dies at its start."""
    ended = threading.Event()

    def watch() -> None:
        while not ended.wait(REPLACE_PERIOD):
            if len(local.scheduler_info["workers"]) < workers:
                local.scale(workers)

    thread = threading.Thread(target=watch, name="worker watch", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _connected(one: DaskCluster) -> Iterator[DaskCluster]:
    one.connect()
    try:
        one.check_workers()
        yield one
    finally:
        one.close()


class DaskCluster:
    """A connection to a scheduler, which can be made again when it was lost."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.client: Any = None

    def connect(self) -> None:
        """Connect, after closing what was connected before. Raises UserError if there is no answer."""
        import distributed

        self.close()
        try:
            self.client = distributed.Client(self.address, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError) as error:
            raise UserError(
                f"the Dask scheduler at {self.address} does not answer: {str(error).splitlines()[0]}"
            ) from None

    def check_workers(self) -> None:
        """Raise UserError that names a worker without chefbot or with other code than this process."""
        try:
            answers = self.client.run(code_hash, on_error="return")
        except (OSError, TimeoutError) as error:
            raise UserError(f"the workers of {self.address} do not answer: {error}") from None
        for worker, answer in answers.items():
            if isinstance(answer, BaseException):
                raise UserError(f"worker {worker} cannot run chefbot: {answer}")
            if answer != code_hash():
                raise UserError(
                    f"worker {worker} has another version of chefbot ({answer}, not {code_hash()});"
                    " install the same there"
                )

    def close(self) -> None:
        """Close the connection to the scheduler, if there is one."""
        client, self.client = self.client, None
        if client is None:
            return
        try:
            client.close(timeout=2)
        except Exception as error:  # a client that failed to reconnect raises what it failed with
            logging.getLogger(__name__).debug("the lost connection to %s: %r", self.address, error)

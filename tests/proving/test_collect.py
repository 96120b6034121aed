"""Runs on a cluster: whatever dies, none is lost and none counts twice."""

from __future__ import annotations

import asyncio
import os
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from tests.support import proving_runs
from tests.support.proving_runs import DRIVE, FOLDER, HELD, tiny_specs
from tests.support.waiting import wait_for

from chefbot.errors import ChefbotError, UserError
from chefbot.proving import cluster as cluster_module
from chefbot.proving import collect as collect_module
from chefbot.proving.cluster import DaskCluster, cluster
from chefbot.proving.collect import MAX_ATTEMPTS, LostRunError, collect
from chefbot.proving.prove import ProveOptions, run_prove
from chefbot.proving.record import RunRecord
from chefbot.proving.results_folder import ResultsFolder
from chefbot.proving.run_spec import code_hash

SPECS = tiny_specs([1, 2, 3, 4, 5])
HELD_SEEDS = [*range(1, 6), *range(11, 16), *range(21, 26)]
"""Seeds of the runs that tests hold back, each of its own: runs that one leaves behind are not held by the next."""
"""Each test has seeds of its own: the scheduler may still have the results of the test before, by the same keys."""


class Collection:
    """A collection under way in a thread, with what it has added."""

    def __init__(self, connected: DaskCluster, specs: list[Any]) -> None:
        self.added: list[RunRecord] = []
        self.error: BaseException | None = None
        self._thread = Thread(target=self._run, args=(connected, specs), daemon=True)
        self._thread.start()

    def _run(self, connected: DaskCluster, specs: list[Any]) -> None:
        try:
            collect(connected, specs, lambda record, _: self.added.append(record))
        except BaseException as error:
            self.error = error

    def seeds(self) -> Counter[int]:
        """Wait for the end and return how often each seed was added."""
        wait_for(lambda: not self._thread.is_alive(), "the end of the collection")
        if self.error is not None:
            raise self.error
        return Counter(record.seed for record in self.added)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER, str(folder))
        # The workers are processes of their own, which import `counted_run`; they get the paths of this one.
        patch.syspath_prepend(Path(__file__).parents[2])
        yield folder


@pytest.fixture(scope="module")
def connected(folder: Path) -> Iterator[DaskCluster]:
    """Two workers of this machine, whose runs are those of `counted_run`."""
    with cluster("", 2) as connected:
        yield connected


@pytest.fixture
def held(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder where the runs are noted; those of HELD_SEEDS are held back until HELD is removed from it."""
    for path in folder.iterdir():
        path.unlink()
    (folder / HELD).write_text(" ".join(map(str, HELD_SEEDS)))
    monkeypatch.setattr(collect_module, "make_run_in_process", proving_runs.counted_run)
    yield folder
    (folder / HELD).unlink(missing_ok=True)


def begun(folder: Path) -> list[tuple[int, int]]:
    """Return the seeds of the runs that are held and have begun, with the process of the last time."""
    return [
        (int(path.name.split("_")[1]), int(text.split()[-1]))
        for path in folder.glob("begun_*")
        if int(path.name.split("_")[1]) in HELD_SEEDS and (text := path.read_text())
    ]


def two_under_way(folder: Path) -> list[tuple[int, int]]:
    found = begun(folder)
    return found if len(found) >= 2 else []


@pytest.mark.slow
def test_a_killed_worker_loses_nothing_and_counts_once(connected: DaskCluster, held: Path) -> None:
    collection = Collection(connected, SPECS)
    seed, worker = wait_for(lambda: two_under_way(held), "two runs")[0]
    os.kill(worker, signal.SIGKILL)
    wait_for(lambda: len({process for _, process in begun(held)}) > 2, "a worker in its place")
    assert collection.added == []
    (held / HELD).unlink()
    assert collection.seeds() == {1: 1, 2: 1, 3: 1, 4: 1, 5: 1}
    assert len((held / f"begun_{seed}").read_text().split()) == 2, "it was made again"
    assert {record.key for record in collection.added} == {spec.key for spec in SPECS}


@pytest.mark.slow
@pytest.mark.parametrize(("how", "seeds"), [("comm", HELD_SEEDS[5:10]), ("restart", HELD_SEEDS[10:])])
def test_a_cut_connection_loses_nothing_and_counts_once(
    connected: DaskCluster, held: Path, how: str, seeds: list[int]
) -> None:
    collection, client = Collection(connected, tiny_specs(seeds)), connected.client
    wait_for(lambda: two_under_way(held), "two runs")
    if how == "comm":
        asyncio.run_coroutine_threadsafe(_abort(client), client.loop.asyncio_loop).result(60)
    else:
        client.close(timeout=2)
    wait_for(lambda: client.status != "running" or how == "comm", "the cut")
    (held / HELD).unlink()
    assert collection.seeds() == dict.fromkeys(seeds, 1)


async def _abort(client: Any) -> None:
    client.scheduler_comm.comm.abort()


@pytest.mark.rotated("proofs on a scheduler")
@pytest.mark.slow
def test_a_client_that_failed_to_reconnect_is_replaced(
    connected: DaskCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(**_: object) -> None:
        raise AssertionError

    connected.client.close()
    monkeypatch.setattr(connected.client, "close", fails)
    done: list[str] = []
    collect(connected, tiny_specs([10]), lambda record, _: done.append(record.key))
    assert len(done) == 1


@pytest.mark.slow
def test_bad_input_that_a_run_meets_ends_the_collection(connected: DaskCluster) -> None:
    specs = [msgspec.structs.replace(spec, code="0123") for spec in tiny_specs([7])]
    with pytest.raises(UserError, match=r"has another version of chefbot .*not 0123"):
        collect(connected, specs, lambda *_: None)


@pytest.mark.rotated("proofs on a scheduler")
@pytest.mark.slow
def test_a_full_disk_here_ends_the_collection(connected: DaskCluster) -> None:
    def full(record: RunRecord, log: bytes) -> None:
        raise ChefbotError("record cannot be written: No space left on device")

    with pytest.raises(ChefbotError, match="No space left on device"):
        collect(connected, tiny_specs([8, 9]), full)


@pytest.mark.rotated("proofs on a scheduler")
@pytest.mark.slow
def test_a_proof_on_a_scheduler_and_its_resumption(
    connected: DaskCluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Real runs, on a scheduler that is named by its address."""
    monkeypatch.setattr("chefbot.proving.prove.compile_kernels", lambda *_: None)
    (tmp_path / "tiny.yaml").write_text(DRIVE)
    out, names = tmp_path / "out", [str(tmp_path / "tiny.yaml")]
    options = ProveOptions(names, "31..32", "", 0, connected.address, out, False, False, None)
    assert run_prove(options) == 0
    first = ResultsFolder(out).records()
    assert [(record.seed, record.success) for record in first] == [(31, True), (32, True)]
    assert first[0].messages != first[1].messages
    (out / "records" / f"{first[1].key}.json").unlink()
    assert run_prove(options._replace(names=[], seeds="", resume=True)) == 0
    again = ResultsFolder(out).records()
    assert again[0] == first[0], "not made again"
    assert (again[1].messages, again[1].figures) == (first[1].messages, first[1].figures)


# Without a cluster


class LostClient:
    """A client whose runs are always lost."""

    def __init__(self) -> None:
        self.connections = 0
        self.address = "tcp://lost:1"
        self.client = SimpleNamespace(
            loop=None,
            submit=lambda *_, key, **__: SimpleNamespace(key=key, status="cancelled", release=lambda: None),
        )

    def connect(self) -> None:
        self.connections += 1


def test_runs_that_are_lost_again_and_again_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("distributed.as_completed", lambda futures, **_: iter(futures))
    lost: Any = LostClient()
    with pytest.raises(
        LostRunError, match=f"5 runs without a result after {MAX_ATTEMPTS} attempts; check tcp://lost:1"
    ):
        collect(lost, SPECS, lambda *_: None)
    assert lost.connections == MAX_ATTEMPTS


@pytest.mark.parametrize(
    "address", ["127.0.0.1:1", "nonsense", "foo://x:1", "tcp://x", "tcp://x:y", "x" * 500]
)
def test_an_address_of_another_form_is_refused(address: str) -> None:
    with pytest.raises(UserError, match="give an address as tcp://HOST:PORT"), cluster(address, 1):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "tls://127.0.0.1:1"])
def test_a_scheduler_that_does_not_answer_has_one_sentence(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "CONNECT_TIMEOUT", "200ms")
    with (
        pytest.raises(UserError, match=f"^the Dask scheduler at {address} does not answer: ") as caught,
        cluster(address, 1),
    ):
        pass
    assert "\n" not in str(caught.value)


def answering(answers: dict[str, Any]) -> DaskCluster:
    one = DaskCluster("tcp://here:1")
    one.client = SimpleNamespace(run=lambda *_, **__: answers)
    return one


def test_workers_with_this_code_are_accepted() -> None:
    answering({"tcp://a:1": code_hash(), "tcp://b:2": code_hash()}).check_workers()
    answering({}).check_workers()  # they may come later


@pytest.mark.parametrize(
    ("answer", "sentence"),
    [
        ("0123", rf"worker tcp://b:2 has another version of chefbot \(0123, not {code_hash()}\)"),
        (ModuleNotFoundError("No module named 'chefbot'"), "worker tcp://b:2 cannot run chefbot: No module"),
    ],
)
def test_a_worker_with_other_code_is_refused_by_name(answer: Any, sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        answering({"tcp://a:1": code_hash(), "tcp://b:2": answer}).check_workers()


def test_workers_that_do_not_answer_are_reported_in_one_sentence() -> None:
    def silent(function: Any, on_error: str) -> Any:
        raise TimeoutError("timed out")

    one = DaskCluster("tcp://here:1")
    one.client = SimpleNamespace(run=silent)
    with pytest.raises(UserError, match="the workers of tcp://here:1 do not answer: timed out"):
        one.check_workers()

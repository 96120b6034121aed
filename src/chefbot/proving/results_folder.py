"""The folder of results: the request, a record per run, and the tables made of them."""

from __future__ import annotations

from pathlib import Path

import msgspec

from chefbot.config import read_bytes
from chefbot.config_text import plain_sections, yaml_text
from chefbot.errors import UserError
from chefbot.proving.record import RunRecord
from chefbot.proving.run_spec import with_absolute_paths
from chefbot.proving.scenario import Scenario
from chefbot.storage.atomic_files import make_folder, os_errors_as_storage_errors, write_atomic

RECORDS, LOGS, SCENARIOS, REQUEST = "records", "logs", "scenarios", "request.json"
RUNS_TABLE, GOALS_TABLE = "runs.parquet", "goals.parquet"
MAX_REQUEST_BYTES = 100_000_000


class Request(msgspec.Struct, frozen=True, kw_only=True):
    """The scenarios of a command with the folders of their files, and seeds for each."""

    scenarios: list[Scenario]
    folders: list[str]
    seeds: list[list[int]]


class ResultsFolder:
    """The records of runs in a folder; each is on disk as soon as its run is done."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def create(self, request: Request) -> None:
        """Create the folder with the request, which `--resume` reads."""
        for name in (RECORDS, SCENARIOS):
            make_folder(self.folder / name)
        write_atomic(self.folder / REQUEST, msgspec.json.format(msgspec.json.encode(request)))
        for scenario, base in zip(request.scenarios, request.folders, strict=True):
            text = yaml_text(plain_sections(with_absolute_paths(scenario, Path(base))), "")
            write_atomic(self.folder / SCENARIOS / f"{scenario.name}.yaml", text.encode())

    def request(self) -> Request:
        """Return the request. Raises UserError if the folder has no results in it."""
        path = self.folder / REQUEST
        if not path.exists():
            raise UserError(f"{self.folder} holds no results to resume: {REQUEST} is missing in it")
        try:
            return msgspec.json.decode(read_bytes(path, "request", MAX_REQUEST_BYTES), type=Request)
        except msgspec.DecodeError as error:
            raise UserError(f"{path} is damaged: {error}") from None

    def add(self, record: RunRecord, log: bytes = b"") -> None:
        """Write a record, and the log of its run. Raises StorageError, e.g. for a full disk."""
        write_atomic(self._path(record.key), msgspec.json.encode(record))
        if log:
            make_folder(self.folder / LOGS)
            write_atomic(self.log_path(record), log)

    def log_path(self, record: RunRecord) -> Path:
        """Return the path of a run's log, if it was recorded."""
        return self.folder / LOGS / f"{record.scenario}_{record.seed}.mcap"

    def find(self, key: str) -> RunRecord | None:
        """Return the record of a run that is done; None for one that is not, or whose file is damaged."""
        try:
            return msgspec.json.decode(self._path(key).read_bytes(), type=RunRecord)
        except (OSError, msgspec.DecodeError):
            return None

    def records(self) -> list[RunRecord]:
        """Return all records, by scenario and seed; of two with both equal the newer one counts.

        Raises UserError if the folder has none.
        """
        paths = sorted((self.folder / RECORDS).glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
        found = [record for path in paths if (record := self.find(path.stem)) is not None]
        if not found:
            raise UserError(f"{self.folder} holds no results of runs")
        latest = {(record.scenario, record.seed): record for record in found}
        return [latest[key] for key in sorted(latest)]

    def _path(self, key: str) -> Path:
        return self.folder / RECORDS / f"{key}.json"


def write_tables(folder: Path, records: list[RunRecord]) -> None:
    """Write one row per run and one row per goal as Parquet; figures are columns."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    figures = sorted({name for record in records for name in record.figures})
    machines = sorted({name for record in records for name in record.machine})
    runs = [
        {
            "scenario": record.scenario,
            "seed": record.seed,
            "success": record.success,
            "failure": record.failure,
            **{name: record.figures.get(name) for name in figures},
            "messages": record.messages,
            "sim_time": record.sim_time,
            "wall_time": record.wall_time,
            "cpu_time": record.cpu_time,
            "memory": record.memory,
            "key": record.key,
            **{f"machine_{name}": record.machine.get(name) for name in machines},
        }
        for record in records
    ]
    goals = [
        {"scenario": record.scenario, "seed": record.seed, **msgspec.to_builtins(goal)}
        for record in records
        for goal in record.goals
    ]
    for name, rows in ((RUNS_TABLE, runs), (GOALS_TABLE, goals)):
        sink = pa.BufferOutputStream()
        pq.write_table(pa.Table.from_pylist(rows), sink)
        with os_errors_as_storage_errors(folder / name):
            write_atomic(folder / name, sink.getvalue().to_pybytes())

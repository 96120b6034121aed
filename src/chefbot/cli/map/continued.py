"""`chefbot map continue` and `merge`: a map is continued with another drive, or with another map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from rich.progress import Progress, TaskID

from chefbot.cli.map.bag_drive import ONLY_TOPICS, BagChoice, naming_log, read_log
from chefbot.cli.map.slam import console, print_results, write_results
from chefbot.cli.map.slam_costs import SlamCosts
from chefbot.cli.map.start_search import FoundStart, find_start
from chefbot.errors import ScanError, UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.agreement import drive_fit
from chefbot.slam.no_return import NoReturn
from chefbot.slam.offline import OfflineMapper, SlamResult, maximum_range
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.storage.atomic_files import folder_for_results
from chefbot.storage.mapped_drives import MappedDrives, algorithm_of, bundle_path, load_drives

MAX_COORDINATE = 1e5
"""Limit of plausible coordinates of a start, m."""


class MapContinuation:
    """A map that is built again from its drives, and then continued, with a progress display."""

    def __init__(self, drives: MappedDrives, progress: Progress, *, takes_start: bool = False) -> None:
        """Build the map. takes_start: whether the user can give the pose at which a drive begins."""
        self._progress, self._params, self.costs = progress, drives.params, SlamCosts()
        self._takes_start = takes_start
        self._mapper = OfflineMapper.beginning_with(drives.params, drives.sessions[0])
        for number, session in enumerate(drives.sessions, 1):
            self._mapper.repeat(session, self._counted(f"drive {number} as before", len(session.stamps)))

    def add(self, title: str, scans: Sequence[RecordedScan], range_max: float, start: SE2 | None) -> None:
        """Add a drive that begins at a pose in the map, or at one that its first scans show."""
        try:
            self._mapper.check_mount(scans[0].odom.between(scans[0].laser))
        except ScanError as error:
            raise UserError(f"{title}: {error}") from None
        before, first = self._mapper.slam.map(), 0
        if start is None:
            first, start = self._find_start(title, before, scans, range_max)
        used = scans[first:]
        self._mapper.map_drive(used, range_max, start, self._counted(title, len(used)))
        self._check(title, before, range_max)

    def _find_start(
        self, title: str, before: Grid, scans: Sequence[RecordedScan], range_max: float
    ) -> FoundStart:
        task = self._progress.add_task(f"{title}: where it begins", total=None)
        advice = "; give --start X Y YAW" if self._takes_start else ""
        found = find_start(before, scans, self._mapper.sensor, range_max, partial(self._show, task), advice)
        self._progress.remove_task(task)
        console.print(
            f"{title} begins on the map: at scan {found.scan} the robot was at {found.pose.text}.",
            markup=False,
        )
        return found

    def result(self) -> SlamResult:
        """Return the map as it is now, with the poses of its drives."""
        return self._mapper.result(None)

    def _check(self, title: str, before: Grid, range_max: float) -> None:
        """Raise UserError if the drive does not agree with the map that it continues."""
        used = [scan for scan in self._mapper.sessions[-1].scans() if len(scan.ranges)]
        poses = self._mapper.slam.trajectory()[-len(used) :]
        fit = drive_fit(before, used, poses, self._mapper.sensor, range_max)
        if not fit.is_good:
            or_start = ", or --start wrong" if self._takes_start else ""
            raise UserError(
                f"{title} does not fit the map: of its beams in known space {fit.share:.0%} end at a wall, of those"
                f" of its first scans {fit.covered:.0%};"
                f" is it another building{or_start}? Nothing is written"
            )

    def finish(self, no_return: NoReturn | None, out: Path, title: Path, *, report: bool) -> None:
        """Write the map and its companions."""
        self.costs.end()
        result = self._mapper.result(no_return)
        write_results(out, self._params, result, self.costs, report=report, title=title)
        print_results(self._params, result, out, sum(self.costs.seconds) + self.costs.finish_seconds)

    def _counted(self, title: str, total: int) -> Callable[[int, int], None]:
        """Return what to call after each scan of a drive."""
        task = self._progress.add_task(title, total=total)

        def after_scan(done: int, total: int) -> None:
            self.costs.add()
            self._show(task, done, total)

        return after_scan

    def _show(self, task: TaskID, done: int, total: int) -> None:
        self._progress.update(task, completed=done, total=total)


def continue_map(
    bundle: Path,
    log: Path,
    out: Path,
    start: tuple[float, float, float] | None,
    report: bool,
    choice: BagChoice = ONLY_TOPICS,
) -> None:
    """Continue a map with a recorded drive; start: pose (x, y, yaw) in the map at its first scan, m and rad.

    Raises UserError if the bundle or the log cannot be read, or the drive does not begin on the map.
    """
    _check_out(bundle, out)
    if start is not None and not all(abs(value) < MAX_COORDINATE for value in start):
        raise UserError(f"--start {start} is not a pose on a map; give x and y in m, and yaw in rad")
    drives = load_drives(bundle)
    with naming_log(log):
        scans, notes = read_log(log, choice)
        for note in notes:
            console.print(note, markup=False)
        range_max, no_return = maximum_range(scans, drives.params.max_range)
        with folder_for_results(out), Progress(console=console) as progress:
            continuation = MapContinuation(drives, progress, takes_start=True)
            continuation.add(str(log), scans, range_max, None if start is None else SE2(*start))
        continuation.finish(no_return, out, log, report=report)


def merge_maps(bundle: Path, other: Path, out: Path, report: bool) -> None:
    """Merge two maps of one building: the drives of the second one continue the first, each from where it begins."""
    _check_out(bundle, out)
    _check_out(other, out)
    drives, others = load_drives(bundle), load_drives(other)
    with folder_for_results(out), Progress(console=console) as progress:
        continuation = MapContinuation(drives, progress)
        for number, session in enumerate(others.sessions, 1):
            scans = list(session.scans())
            if algorithm_of(drives.params) != algorithm_of(others.params):
                # Another mapper would use other scans, which have no beams
                scans = [scan for scan in scans if len(scan.ranges)]
            continuation.add(f"{other}, drive {number}", scans, session.range_max, None)
    continuation.finish(None, out, other, report=report)


def _check_out(bundle: Path, out: Path) -> None:
    """Raise UserError if the results would replace the map that is continued."""
    if bundle_path(bundle).parent.resolve() == out.resolve():
        raise UserError(f"--out {out} is the folder of the map that is continued; give another one")

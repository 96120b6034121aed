"""`chefbot map slam`: build a map from a recorded log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from chefbot.cli.map.bag_drive import ONLY_TOPICS, BagChoice, naming_log, read_log
from chefbot.cli.map.odometry_text import odometry_text
from chefbot.cli.map.slam_costs import SlamCosts
from chefbot.cli.map.slam_pictures import QUALITY_PICTURE
from chefbot.cli.map.slam_report import report_page
from chefbot.plural import number_of
from chefbot.runtime.clock import wall_ns
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.offline import SlamResult, run_log, trajectory_tum
from chefbot.slam.params import MATCH_RANGE, GmappingParams
from chefbot.slam.recorded_scan import NO_RETURN, RecordedScan
from chefbot.slam.systematic_errors import errors_of_drives
from chefbot.storage.atomic_files import folder_for_results
from chefbot.storage.mapped_drives import BUNDLE, MapperParams, files_beside_map
from chefbot.storage.new_map import save_new_map

console = Console(highlight=False)


def run_slam(
    path: Path,
    out: Path,
    algorithm: str,
    particles: int,
    seed: int,
    max_range: float,
    *,
    report: bool = False,
    choice: BagChoice = ONLY_TOPICS,
) -> None:
    """Build a map from a log or a bag with a progress display; write trajectory and map into `out`.

    algorithm: "gmapping", the particle filter, which uses particles and seed, or "graph", the pose graph. report:
    whether `report.html` is written, too.

    Raises UserError if the log is invalid or the folder cannot be written.
    """
    matched = min(max_range, MATCH_RANGE)
    params: GmappingParams | GraphSlamParams = GraphSlamParams(max_range=max_range, match_range=matched)
    if algorithm == "gmapping":
        params = GmappingParams(particles=particles, seed=seed, max_range=max_range, match_range=matched)
    began, costs = wall_ns(), SlamCosts()
    with naming_log(path):
        drive = read_log(path, choice)
        for note in drive.notes:
            console.print(note, markup=False)
        with folder_for_results(out):  # before minutes are spent on the map
            result = _run(path, drive.scans, params, costs)
    write_results(out, params, result, costs, report=report, title=path)
    print_results(params, result, out, (wall_ns() - began) / 1e9)


def write_results(
    out: Path, params: MapperParams, result: SlamResult, costs: SlamCosts, *, report: bool, title: Path
) -> None:
    """Write the map, its trajectory, picture and bundle, and report.html if wanted, into a folder."""
    companions = files_beside_map(params, result.sessions, result.grid)
    companions["trajectory.tum"] = trajectory_tum(result).encode()
    if report:
        companions["report.html"] = report_page(title, params, result, costs).encode()
    save_new_map(out / "map", result.grid, [(out / name, data) for name, data in companions.items()])
    (out / QUALITY_PICTURE).unlink(missing_ok=True)  # of a map that was here before


def print_results(params: MapperParams, result: SlamResult, out: Path, took: float) -> None:
    """Print what was found, and where it is."""
    if result.no_return is not None:
        minimum, share = result.no_return
        if minimum >= NO_RETURN:  # the log itself distinguishes them
            console.print(f"{share:.1%} of all beams have no return.")
        else:
            console.print(f"Ranges of {minimum:.2f} m and more count as no return: {share:.1%} of all beams.")
    if isinstance(params, GraphSlamParams):
        console.print(f"{number_of(len(result.closures), 'loop closure')}.")
    console.print(f"Correction of all ranges: {1e3 * result.range_offset:+.0f} mm, estimated from the scans.")
    console.print(odometry_text(errors_of_drives(result.sessions, result.poses)))
    if len(result.poses) == 1:
        console.print("Only one scan is in the map: the robot of this log stands still.")
    console.print(
        f"{number_of(len(result.poses), 'scan')}, {took:.1f} s; {out}/map.yaml, map.png, {BUNDLE}, trajectory.tum"
    )


def _run(
    path: Path,
    scans: Sequence[RecordedScan],
    params: GmappingParams | GraphSlamParams,
    costs: SlamCosts,
) -> SlamResult:
    """Run SLAM over the scans with a progress bar and note the costs of each scan."""
    with Progress(console=console) as progress:
        task = progress.add_task(f"mapping {path.name}", total=None)

        def after_scan(done: int, total: int) -> None:
            costs.add()
            progress.update(task, completed=done, total=total)

        result = run_log(scans, params, after_scan)
    costs.end()
    return result

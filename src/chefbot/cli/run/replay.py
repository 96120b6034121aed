"""`chefbot replay`: run the nodes again on a recorded log."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from chefbot.errors import UserError
from chefbot.incidents.files import read_incident
from chefbot.kernels.precompile import compile_kernels
from chefbot.plural import number_of
from chefbot.runtime.recorded_log import RecordedLog, read_intact_part, read_log
from chefbot.runtime.replay import Replay

console = Console(highlight=False, soft_wrap=True)


def _log_to_show(path: Path) -> RecordedLog:
    """Read a log, or the part before the damage, with a sentence about that."""
    log = read_intact_part(path)
    if log.damage:
        number = number_of(len(log.messages), "message")
        console.print(
            f"{path} is damaged or cut off ({log.damage}); the {number} before are shown.", markup=False
        )
    return log


def run_replay(path: Path, *, check: bool, show: bool = False, port: int = 8080) -> int:
    """Replay a log and compare the outputs, or show it. Returns the exit code: 1 if one differs and `check` is on.

    A log that was cut off is shown as far as it goes. UserError for an incident with `check`: its nodes cannot be run
    again without what they knew before.
    """
    log = _log_to_show(path) if show else read_log(path)
    incident = read_incident(path)
    if incident is not None and check:
        raise UserError(
            f"{path} is an incident, which begins in the middle of a run, so its nodes cannot be run again; "
            "leave --check out to see it"
        )
    if show or incident is not None:
        from chefbot.cli.run.show_log import show_log

        return show_log(log, path, incident, port)
    compile_kernels(console)
    replay = Replay(log)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task(f"replaying {path}", total=len(log.messages))
        replay.run(lambda done, total: progress.update(task, completed=done, total=total))
    for sentence, count in replay.faults.counts.items():
        console.print(f"{count} times: {sentence}", markup=False)
    if not replay.differences:
        console.print(f"{path}: {replay.compared} messages of nodes, all bit-identical")
        return 0
    first = replay.differences[0]
    console.print(
        f"{path}: after {first.position} equal messages the log contains {first.logged}, the replay {first.replayed}"
    )
    return 1 if check else 0

"""Logs that were cut off are read up to there."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.incidents.files import Incident, save_incident
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.runtime.loop import Publication
from chefbot.runtime.recorded_log import read_intact_part, read_log

ROBOT = load_robot("chefbot")
INCIDENT = Incident(robot="chefbot", time="2026-01-31T09:05:00Z", sentence="Lost.", by="")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of enough messages for several chunks."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    publications = (
        Publication("phase", String(f"{number} " * 400), "wire", True, number * 1_000_000, False)
        for number in range(3000)
    )
    return save_incident(path, INCIDENT, publications, ROBOT, 7)


@pytest.mark.parametrize("share", [1.0, 0.999, 0.7, 0.4])
def test_the_intact_part_of_a_log_is_read(recorded: Path, tmp_path: Path, share: float) -> None:
    """After `kill -9` or a power cut the index at the end is missing, and that is when one wants to look."""
    whole, data = read_log(recorded), recorded.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: round(share * len(data))])
    log = read_intact_part(cut)
    assert log.messages == whole.messages[: len(log.messages)] and log.robot == whole.robot
    assert bool(log.damage) == (share < 1.0) and len(log.messages) >= 0.3 * share * 3000
    if share < 1.0:
        with pytest.raises(UserError, match="cannot be replayed"):
            read_log(cut)


def test_a_log_cut_before_its_first_message_is_one_sentence(recorded: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recorded.read_bytes()[:2000])
    with pytest.raises(UserError, match=r"cut.mcap is damaged before its first message: it ends"):
        read_intact_part(cut)

"""`chefbot board test` on the emulated board: a board that is right, and one with mistakes of the wiring."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from tests.devices.emulated import Emulator

from chefbot.board.bring_up import StepResponse
from chefbot.cli.board import bring_up
from chefbot.cli.board.step_picture import StepCurve, write_picture
from chefbot.errors import UserError
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
TURN = round(5 * ROBOT.motor.ticks_per_turn)
Answer = str | Callable[[], str]


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[Emulator]:
    with closing(Emulator(tmp_path)) as one:
        yield one


class Owner:
    """Answers the questions by the words in them, and does what they ask for at the emulated board."""

    def __init__(self, board: Emulator, **answers: Answer) -> None:
        self._board, self._answers, self.questions = board, answers, list[str]()

    def prompt(self, question: str, default: object = "", type: type | None = None) -> object:
        self.questions.append(question)
        given = next((answer for word, answer in self._answers.items() if word in question.lower()), None)
        value = given() if callable(given) else given
        text = default if value is None else value
        return type(text) if type is not None else text

    def confirm(self, question: str, **_: bool) -> bool:
        self.questions.append(question)
        if "emergency" in question:
            threading.Timer(0.5, self._press).start()
        return True

    def _press(self) -> None:
        self._board.inject("estop 1")
        time.sleep(1.0)
        self._board.inject("estop 0")


def turn(board: Emulator, side: int, ticks: int) -> Callable[[], str]:
    def by_hand() -> str:
        board.inject(f"turn {side} {ticks}")
        return ""

    return by_hand


def run(
    monkeypatch: pytest.MonkeyPatch, owner: Owner, board: Emulator, robot: str, out: Path, write: bool = False
) -> int:
    monkeypatch.setattr(bring_up.typer, "prompt", owner.prompt)
    monkeypatch.setattr(bring_up.typer, "confirm", owner.confirm)
    return bring_up.run_board_test(robot, str(board.path), out, write, seconds=60.0, attempts=40)


@pytest.mark.rotated("board test")
@pytest.mark.slow
def test_a_board_that_is_right_passes(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hands = {"turn the left": turn(emulated, 0, TURN), "turn the right": turn(emulated, 1, TURN)}
    owner = Owner(emulated, **hands)
    code = run(monkeypatch, owner, emulated, "chefbot", tmp_path / "step.png")
    text = capsys.readouterr().out
    assert code == 0, text
    assert "MPU-6050" in text and "No problems found." in text and "90 % of the speed after" in text
    assert (tmp_path / "step.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.rotated("board test")
@pytest.mark.slow
def test_mistakes_are_named_and_measures_are_written(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "mine.yaml"
    robot.write_text("like: chefbot\nname: mine\n")
    emulated.inject("imu 0")
    emulated.inject("cable 1 0")  # the right encoder
    hands = {"turn the left": turn(emulated, 0, -TURN), "turn the right": turn(emulated, 1, 0)}
    owner = Owner(emulated, meter="13.5", **hands)
    code = run(monkeypatch, owner, emulated, str(robot), tmp_path / "step.png", write=True)
    text = capsys.readouterr().out
    assert code == 1, text
    assert "No IMU answers" in text
    assert "left encoder counts backward" in text and "right encoder counted 0 ticks" in text
    assert "right encoder counted nothing while its motor was driven" in text
    assert load_robot(str(robot)).calibration.battery > 1.04  # it is charged to 12.6 V at most
    assert not (tmp_path / "step.png").exists()


def test_the_picture_shows_each_wheel(tmp_path: Path) -> None:
    times = np.arange(0.0, 1.0, 0.02)
    curve = StepCurve("left", times, np.full(len(times), 900.0), 1000.0, StepResponse(0.1, 0.0, -0.1))
    write_picture([curve, curve._replace(side="right")], tmp_path / "new" / "step.png")
    assert (tmp_path / "new" / "step.png").stat().st_size > 5000


@pytest.mark.slow
def test_ended_answers_and_built_in_robots_have_one_sentence(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with pytest.raises(UserError, match="is a built-in robot"):
        bring_up.run_board_test("chefbot", str(emulated.path), tmp_path / "step.png", write=True)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    with pytest.raises(UserError, match="the answers ended"):
        bring_up.run_board_test("chefbot", str(emulated.path), tmp_path / "step.png", write=False)


@pytest.mark.parametrize("meter", ["1", "nan", "12,6", "-3"])
@pytest.mark.slow
def test_a_reading_that_cannot_be_is_not_written(
    meter: str, emulated: Emulator, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = load_robot("chefbot")
    monkeypatch.setattr(bring_up.typer, "prompt", Owner(emulated, meter=meter).prompt)
    with bring_up.opened_port(str(emulated.path)) as port:
        board = bring_up.BenchBoard(port, robot)
        board.open()
        test = bring_up.BoardTest(board, robot)
        test._check_battery()
    assert not test.changes and f"'{meter}' V is not what the board measures" in capsys.readouterr().out

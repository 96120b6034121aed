"""A built robot on emulated hardware: its processes, what is waited for, and the drive through map and goals."""

from __future__ import annotations

import math
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.proving.fake_run import ROBOT
from tests.support.proving_runs import tiny_specs

from chefbot.demo.score import ARRIVAL_TOLERANCE
from chefbot.errors import UserError
from chefbot.maths.grid import FREE
from chefbot.maths.se2 import SE2
from chefbot.proving import built_robot
from chefbot.proving.built_robot import BuiltSetup, HardwareProcess, RobotProcess, end_process, free_port
from chefbot.proving.scenario_tasks import BuiltTask
from chefbot.proving.simulated_run import TaskFailedError
from chefbot.proving.tasks import built
from chefbot.proving.tasks.built import STANDING_TIME, BuiltDrive, drawn_goals, drive_built
from chefbot.sim.ports.hardware import TrueState
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.world import load_world

PYTHON = (sys.executable, "-c")
ECHO = """import json, sys
for k in range(3):
    print(json.dumps(dict(time=k, pose=[k, 0, 0], collisions=0, touched="")))
sys.stdout.flush()
open({!r}, "w").write(sys.stdin.readline())
"""
"""States the pose three times, and writes the first request into a file."""


def setup(folder: Path) -> BuiltSetup:
    return BuiltSetup("chefbot_lidar", "room", "real", 1, folder)


def running(monkeypatch: pytest.MonkeyPatch, program: str) -> None:
    """Let a short program stand for `chefbot`."""
    monkeypatch.setattr(built_robot, "CHEFBOT", (*PYTHON, program))


# Processes


def test_true_states_are_read_and_requests_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    running(monkeypatch, ECHO.format(str(tmp_path / "request")))
    hardware = HardwareProcess(setup(tmp_path))
    try:
        hardware.wait(lambda: len(hardware.states) == 3, "nothing was read", 20.0)
        assert hardware.states[-1] == TrueState(2, [2, 0, 0], 0, "")  # type: ignore[arg-type]
        hardware.request("unplug lidar")
        hardware._process.wait(20.0)
        assert (tmp_path / "request").read_text() == "unplug lidar\n"
        with pytest.raises(TaskFailedError, match=r"has ended, see hardware\.log"):
            _ = hardware.pose
        with pytest.raises(TaskFailedError, match="has ended"):
            hardware.wait(lambda: False, "it", 20.0)
    finally:
        hardware.close()


def test_what_does_not_happen_in_time_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    running(monkeypatch, "input()")
    hardware = HardwareProcess(setup(tmp_path))
    try:
        with pytest.raises(TaskFailedError, match="the floor was not swept after 0 s"):
            hardware.wait(lambda: False, "the floor was not swept", 0.0)
        hardware.wait(lambda: True, "nothing", 0.0)
    finally:
        hardware.close()


def test_the_hardware_gets_the_setup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    running(
        monkeypatch, f"import sys; open({str(tmp_path / 'arguments')!r}, 'w').write(' '.join(sys.argv[1:]))"
    )
    hardware = HardwareProcess(setup(tmp_path))
    hardware._process.wait(20.0)
    hardware.close()
    arguments = (tmp_path / "arguments").read_text()
    assert arguments.startswith("board emulate --robot chefbot_lidar --world room --profile real --seed 1")
    assert f"--link {tmp_path / 'board'}" in arguments and f"--lidar {tmp_path / 'lidar'}" in arguments


def test_a_launch_gets_the_ports_and_commands_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    running(monkeypatch, "import sys; print(sys.argv[1:]); sys.exit('--fail' in sys.argv)")
    hardware: Any = SimpleNamespace(board=tmp_path / "board", lidar=tmp_path / "lidar")
    robot = RobotProcess(setup(tmp_path), hardware, "explore", "extra:=1")
    robot._process.wait(20.0)
    with pytest.raises(TaskFailedError, match="the robot does not start"):
        robot.page()
    robot.command("map", "save")
    with pytest.raises(TaskFailedError, match=r"chefbot map save: .*--fail"):
        robot.command("map", "save", "--fail")
    robot.close()
    given = (tmp_path / "explore.log").read_text()
    assert given.startswith("['launch', 'explore', 'built:=true'")
    for argument in (f"board_port:={tmp_path / 'board'}", "robot:=chefbot_lidar", "seed:=1", "extra:=1"):
        assert repr(argument) in given


def test_a_process_that_ignores_the_interrupt_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(built_robot, "STOP_TIMEOUT", 0.2)
    program = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); print(flush=True); signal.pause()"
    process = subprocess.Popen([*PYTHON, program], stdout=subprocess.PIPE, stdin=subprocess.PIPE)
    assert process.stdout is not None
    with process.stdout as ready:
        ready.readline()
    end_process(process)
    assert process.returncode == -9
    end_process(process)  # it has ended already


def test_a_process_ends_by_the_interrupt() -> None:
    process = subprocess.Popen([*PYTHON, "input()"], stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
    end_process(process)
    assert process.returncode != -9
    assert process.stdin is not None and process.stdin.closed


def test_a_free_port_can_be_listened_to() -> None:
    with socket.socket() as server:
        server.bind(("127.0.0.1", free_port()))


def stands(times_and_x: list[tuple[float, float]], seconds: float) -> bool:
    hardware: Any = HardwareProcess.__new__(HardwareProcess)
    hardware._process = SimpleNamespace(poll=lambda: None)
    hardware.states = [TrueState(time, (x, 0.0, 0.0), 0, "") for time, x in times_and_x]
    return bool(hardware.stands(seconds))


def test_a_robot_stands_after_some_time_in_one_place() -> None:
    moving, still = [(0.1 * k, 0.05 * k) for k in range(50)], [(5.0 + 0.1 * k, 2.5) for k in range(60)]
    assert not stands(moving, 2.0)
    assert not stands(moving + still[:15], 2.0)
    assert stands(moving + still[:25], 2.0) and stands(moving + still, 2.0)
    assert not stands(still[:10], 2.0), "too few states are known"
    assert not stands([*still, (11.0, 2.52)], 2.0)


# The drive


def test_goals_are_drawn_where_the_robot_gets_to() -> None:
    world = load_world("room")
    floor, rng = reachable(world, ROBOT), np.random.default_rng(3)
    goals = drawn_goals(world, ROBOT, rng, 12)
    before = SE2(0.0, 0.0, 0.0)
    for goal in goals:
        pose = world.start @ goal
        row, column = floor.cell(pose.x, pose.y)
        assert floor.cells[row, column] == FREE
        assert goal.distance(before) > 2.0 * ARRIVAL_TOLERANCE
        before = goal
    again = drawn_goals(world, ROBOT, np.random.default_rng(3), 12)
    assert goals == again and len({goal.yaw for goal in goals}) == 12


class FakeHardware:
    """A robot that does what the commands of `FakeRobot` request, in no time."""

    def __init__(self, _: BuiltSetup) -> None:
        self.states = [TrueState(0.0, (0.0, 0.0, 0.0), 0, "")]
        self.standing, self.closed = True, False

    @property
    def newest(self) -> TrueState:
        return self.states[-1]

    @property
    def pose(self) -> SE2:
        return SE2(*self.newest.pose)

    def drive(self, *points: tuple[float, float, float]) -> None:
        for point in points:
            self.states.append(TrueState(self.newest.time + 1.0, point, 2, "wall"))

    def wait(self, condition: Any, what: str, limit: float) -> None:
        if not condition():
            raise TaskFailedError(f"{what} after {limit:.0f} s")

    def stands(self, seconds: float) -> bool:
        assert seconds == STANDING_TIME
        return self.standing

    def close(self) -> None:
        self.closed = True


class FakeRobot:
    """The launch of a robot that explores at once, and drives to each goal but to those in `lost`."""

    lost = 99
    explores = True

    def __init__(self, _: BuiltSetup, hardware: FakeHardware, launch: str, *arguments: str) -> None:
        self.hardware, self.launch, self.arguments, self.driven = hardware, launch, arguments, 0
        if launch == "explore" and self.explores:
            hardware.drive((2.0, 0.0, 0.0), (0.1, 0.0, 0.0))

    def command(self, group: str, verb: str, *arguments: str) -> None:
        if (group, verb) == ("map", "save"):
            assert arguments[0] == "-f"
            return
        assert (group, verb, arguments[0]) == ("drive", "goto", "--")
        x, y, degrees = map(float, arguments[1:])
        self.driven += 1
        if self.driven != self.lost:
            self.hardware.drive((x, y, math.radians(degrees)))

    def layer(self, name: str) -> dict[str, float]:
        assert name == "robot"
        pose = self.hardware.pose @ SE2(0.0, 0.03, 0.0)
        return pose._asdict()

    def close(self) -> None: ...


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch) -> type[FakeRobot]:
    class Robot(FakeRobot): ...

    monkeypatch.setattr(built, "HardwareProcess", FakeHardware)
    monkeypatch.setattr(built, "RobotProcess", Robot)
    return Robot


def drive(folder: Path, goals: int = 3) -> tuple[str, built.BuiltRun]:
    (spec,) = tiny_specs([5], task=BuiltTask(goals=goals), robot="chefbot_lidar")
    return drive_built(spec, load_world("room"), "room", folder)


def test_a_robot_maps_returns_and_drives_to_all_goals(tmp_path: Path, fakes: type[FakeRobot]) -> None:
    failure, left = drive(tmp_path)
    assert failure == "" and len(left.goals) == 3
    assert all(goal.reached and goal.distance < 0.01 for goal in left.goals)
    assert left.figures["goals_reached"] == 1.0 and left.figures["collisions"] == 2.0
    assert left.figures["localization_error_max"] == pytest.approx(0.03)
    assert left.figures["localization_error_median"] == pytest.approx(0.03)
    assert left.figures["time"] == 5.0 and left.figures["path_length"] > 3.9


def test_a_goal_that_is_not_reached_is_named(tmp_path: Path, fakes: type[FakeRobot]) -> None:
    fakes.lost = 2
    failure, left = drive(tmp_path)
    missed = left.goals[1]
    assert failure == f"not reached: {missed.place}" and not missed.reached
    assert missed.reason.startswith("the goal was not reached after") and missed.distance > ARRIVAL_TOLERANCE
    assert left.figures["goals_reached"] == pytest.approx(2 / 3) and len(left.goals) == 3


def test_a_robot_that_never_left_its_start_has_mapped_nothing(tmp_path: Path, fakes: type[FakeRobot]) -> None:
    fakes.explores = False
    failure, left = drive(tmp_path)
    assert failure.startswith("the building was not mapped after")
    assert left.figures == {"time": 0.0, "path_length": 0.0, "collisions": 0.0} and left.goals == []


def test_a_robot_that_still_moves_has_not_returned(tmp_path: Path, fakes: type[FakeRobot]) -> None:
    (spec,) = tiny_specs([5], task=BuiltTask(goals=1), robot="chefbot_lidar")
    one: Any = BuiltDrive(spec, load_world("room"), "room", tmp_path)
    one.hardware.drive((2.0, 0.0, 0.0), (0.2, 0.1, 0.0))
    assert one._has_returned() and one.path_length == pytest.approx(2.0 + math.hypot(1.8, 0.1))
    one.hardware.standing = False
    assert not one._has_returned()
    one.hardware.standing = True
    one.hardware.drive((0.5, 0.0, 0.0))
    assert not one._has_returned()


def test_a_robot_of_a_file_is_refused(tmp_path: Path, fakes: type[FakeRobot]) -> None:
    (spec,) = tiny_specs([5], task=BuiltTask(goals=1), robot="chefbot_lidar")
    foreign = msgspec.structs.replace(spec, robot=msgspec.structs.replace(spec.robot, name="my_own"))
    with pytest.raises(UserError, match="robot my_own: the task `built` needs a built-in robot"):
        BuiltDrive(foreign, load_world("room"), "room", tmp_path)

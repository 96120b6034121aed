"""Web UI, keyboard and mapping on another machine than the robot, as a person starts them."""

from __future__ import annotations

import os
import pty
import signal
import time
from collections.abc import Callable

import pytest
from tests.support.network import PATIENCE, Machine, Network, end, needs_namespaces
from tests.support.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_namespaces, pytest.mark.usefixtures("fleet")]
ROBOT = ("robot:=chefbot_lidar", "world:=room", "people:=0", "pictures:=0")
HELD = 0.5
"""How far the stick is pushed."""


def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.05)


def place_of(page: Machine) -> tuple[float, float, float]:
    """x, y, speed as the web UI shows them; it shows none while its transforms are too old on a busy computer."""
    robot = wait_for(lambda: page.request("now robot"))
    assert isinstance(robot, dict)
    return robot["x"], robot["y"], robot["v"]


def goes_to(page: Machine, x: float, y: float) -> None:
    """A goal is given, and reached."""
    page.request(f'do {{"do":"goal","x":{x},"y":{y},"yaw":0}}')

    def there() -> bool:
        here = place_of(page)
        return abs(here[0] - x) < 0.12 and abs(here[1] - y) < 0.12

    until(there)


def drive_off(page: Machine) -> float:
    """Drive forward and return x; the robot stands while a process does not respond, as on a busy computer."""

    def moved() -> bool:
        before = place_of(page)[0]
        page.request(f"drive {HELD} 0 1.5")
        after = place_of(page)[0]
        assert after - before < 0.4
        return after > 0.1

    until(moved)
    return place_of(page)[0]


def refusal(network: Network, *arguments: str) -> str:
    """The output of `chefbot launch` on alice's machine, which ends with exit code 2."""
    process = network.chefbot("alice", "launch", *arguments)
    output = end(process)
    assert process.returncode == 2, output
    return output


@pytest.mark.rotated("launches of several processes")
def test_the_web_ui_runs_on_another_machine(network: Network) -> None:
    network.chefbot("robot1", "launch", "gmapping_demo", *ROBOT, "headless:=true")
    join = ("--join", f"tls/{network.address('robot1')}")
    network.chefbot("alice", "launch", "remote_page", "robot:=chefbot_lidar", *join)
    page = network.page_user("alice")
    for layer in ("map", "scan", "robot", "status", "fixed_frames", "description"):
        assert page.request(f"see {layer}"), layer
    assert "kitchen" in str(page.request("see places"))  # published once, before the web UI was there

    driven = drive_off(page)
    page.send(f"drive -{HELD} 0 4")
    time.sleep(1.0)
    network.link("alice", "down")
    page.answer()
    network.link("alice", "up")
    until(lambda: page.request("now status") != page.request("now status"))
    x, _, speed = place_of(page)
    assert abs(speed) < 0.01
    assert driven - 0.3 < x < driven  # 4 s of it would be 0.6 m
    goes_to(page, driven + 0.3, 0.2)

    page.request(
        'do {"do":"open_door","name":"no_such"}'
    )  # the robot answers on /rosout, where all nodes log
    logs = network.chefbot("alice", "topic", "echo", "/rosout", "--field", "msg", "--duration", "6")
    assert "no_such" in end(logs)

    assert "is a chefbot_lidar, not a chefbot" in refusal(network, "remote_teleop", "robot:=chefbot")
    assert "remote_page runs already" in refusal(network, "remote_page", "robot:=chefbot_lidar")


@pytest.mark.rotated("launches of several processes")
def test_the_web_ui_follows_a_robot_that_is_restarted(network: Network) -> None:
    robot = network.chefbot("robot1", "launch", "gmapping_demo", *ROBOT, "headless:=true")
    join = ("--join", f"tls/{network.address('robot1')}")
    there = network.chefbot("alice", "launch", "remote_page", "robot:=chefbot_lidar", *join)
    page = network.page_user("alice")
    assert page.request("see map")
    robot.send_signal(signal.SIGINT)
    end(robot)
    network.chefbot("robot1", "launch", "gmapping_demo", *ROBOT, "headless:=true")
    until(lambda: page.request("pages") == 2)  # it comes again with the robot
    assert page.request("see map")
    assert "kitchen" in str(page.request("see places"))
    assert abs(place_of(page)[0]) < 0.05
    there.send_signal(signal.SIGINT)
    assert "The robot was restarted" in end(there)


@pytest.mark.rotated("launches of several processes")
def test_slam_and_web_ui_of_one_launch_run_on_another_machine(network: Network) -> None:
    same = ("launch", "several_machines", *ROBOT, "slam:=alice", "screen:=alice")
    robot = network.chefbot("robot1", *same)
    network.chefbot("alice", *same, "--join", f"tls/{network.address('robot1')}")
    page = network.page_user("alice")
    assert page.request("see map")
    goes_to(page, 0.5, 0.2)
    robot.send_signal(signal.SIGINT)
    output = end(robot)
    assert "On host alice: " in output and "gmapping" in output
    assert "did you mean 'alice'" in refusal(network, *same[1:], "--host", "alise")


@pytest.mark.rotated("launches of several processes")
def test_keyboard_teleop_runs_on_another_machine(network: Network) -> None:
    network.chefbot("robot1", "launch", "chefbot_empty_world", "robot:=chefbot_lidar", "pictures:=0")
    page = network.page_user("robot1")
    page.request("see robot")
    mine, theirs = pty.openpty()
    keys = network.chefbot(
        "alice",
        "launch",
        "remote_teleop",
        "robot:=chefbot_lidar",
        "--join",
        f"tls/{network.address('robot1')}",
        stdin=theirs,
    )
    give_up = time.monotonic() + PATIENCE
    while place_of(page)[0] < 0.05:
        assert time.monotonic() < give_up
        os.write(mine, b"iiiii")
    keys.send_signal(signal.SIGKILL)
    keys.communicate()
    until(lambda: abs(place_of(page)[2]) < 0.01)
    os.close(mine)
    os.close(theirs)


@pytest.mark.rotated("launches of several processes")
def test_emergency_stop_is_shared_by_all_pages_and_machines(network: Network) -> None:
    network.chefbot("robot1", "launch", "chefbot_empty_world", "robot:=chefbot_lidar", "pictures:=0")
    join = ("robot:=chefbot_lidar", "--join", f"tls/{network.address('robot1')}")
    network.chefbot("alice", "launch", "remote_page", *join)
    here, there = network.page_user("robot1"), network.page_user("alice")

    def shows(page: Machine, stopped: bool, pending: bool = False) -> bool:
        status = page.request("now status")  # None until the first one has arrived
        return isinstance(status, dict) and (status["stopped"], status["stop_pending"]) == (stopped, pending)

    until(lambda: there.request("now robot") is not None)
    there.request('do {"do":"stop"}')
    until(lambda: shows(here, True) and shows(there, True))
    here.request('do {"do":"release_stop"}')
    until(lambda: shows(here, False) and shows(there, False))
    network.link("alice", "down")
    there.request('do {"do":"stop"}')
    until(lambda: shows(there, False, pending=True))
    assert shows(here, False)
    network.link("alice", "up")
    until(lambda: shows(here, True) and shows(there, True))
    there.request('do {"do":"release_stop"}')
    until(lambda: shows(here, False) and shows(there, False))

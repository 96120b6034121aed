"""The firmware's core and our session over a wire that damages and loses: nothing moves unasked, odometry holds."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import NamedTuple

import pytest
from tests.firmware.host_board import HostBoard

from chefbot.board import BoardSession, SensorConverter
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
STEP_NS = 10_000_000
SEPARATION, METRES = ROBOT.wheels.separation, ROBOT.metres_per_tick


class Pose(NamedTuple):
    x: float
    y: float
    yaw: float

    def moved(self, left: float, right: float) -> Pose:
        """After the wheels have rolled so far, on an arc."""
        turn, arc = (right - left) / SEPARATION, (left + right) / 2.0
        chord = arc * (math.sin(turn / 2.0) / (turn / 2.0) if turn else 1.0)
        heading = self.yaw + turn / 2.0
        return Pose(self.x + chord * math.cos(heading), self.y + chord * math.sin(heading), self.yaw + turn)


Wire = Callable[[bytes, random.Random], bytes]


def bits_and_frames(bit_errors: float, lost_frames: float) -> Wire:
    """Each line is lost with a probability, and each bit of the others turned with another."""

    def pass_on(data: bytes, chance: random.Random) -> bytes:
        kept = bytearray()
        for line in data.splitlines(keepends=True):
            if chance.random() < lost_frames:
                continue
            for byte in line:
                hurt = sum(1 << bit for bit in range(8) if chance.random() < bit_errors)
                kept.append(byte ^ hurt)
        return bytes(kept)

    return pass_on


class Rig:
    """Wheels that turn as the board wants them, both counted where they turn and as received over the wire."""

    def __init__(self, wire: Wire, seed: int) -> None:
        self.board, self.session, self.sensors = HostBoard(), BoardSession(ROBOT), SensorConverter(ROBOT)
        self.wire, self.chance = wire, random.Random(seed)
        self.now, self.disturbed = 0, False
        self.rest = [0.0, 0.0]
        self.true = self.estimated = Pose(0.0, 0.0, 0.0)
        self.path = 0.0
        self.received: WheelTicks | None = None
        self.lines = 0
        self.worst = 0.0

    def step(self, command: tuple[float, float] | None) -> None:
        """A control step; command: speeds of the wheels at the ground, m/s."""
        self.now += STEP_NS
        self._roll()
        self.board.set_imu_at_rest()
        self.board.lib.chefbot_board_advance(self.board.handle, STEP_NS // 1000)
        for received in self.session.receive_data(self._over(self.board.read()), self.now):
            for message in self.sensors.messages(received):
                if isinstance(message, WheelTicks):
                    self._integrate(message)
        sent = b""
        if command is not None and self.now % (5 * STEP_NS) == 0:
            sent += self.session.command(*(speed / ROBOT.wheel_radius for speed in command), self.now)
        elif self.now % (2 * STEP_NS) == 0:
            sent += self.session.data_to_send(self.now)
        if data := self._over(sent):
            self.board.write(data)

    def _over(self, data: bytes) -> bytes:
        return self.wire(data, self.chance) if self.disturbed else data

    def _roll(self) -> None:
        """At the set speed; what is not a whole tick waits."""
        state, rolled = self.board.state, [0, 0]
        for wheel in (0, 1):
            self.rest[wheel] += state.set[wheel] * STEP_NS / 1e9
            rolled[wheel] = math.floor(self.rest[wheel])
            self.rest[wheel] -= rolled[wheel]
            self.board.lib.chefbot_board_turn(self.board.handle, wheel, rolled[wheel])
        self.true = self.true.moved(rolled[0] * METRES, rolled[1] * METRES)
        self.path += abs(sum(rolled)) / 2.0 * METRES

    def _integrate(self, ticks: WheelTicks) -> None:
        before, self.received = self.received, ticks
        self.lines += 1
        if before is not None:
            left, right = ticks.left - before.left, ticks.right - before.right
            self.estimated = self.estimated.moved(left * METRES, right * METRES)

    @property
    def speeds(self) -> tuple[int, int]:
        set_left, set_right = self.board.state.set
        return set_left, set_right

    @property
    def error(self) -> float:
        return math.hypot(self.true.x - self.estimated.x, self.true.y - self.estimated.y)


def weave(seconds: float) -> tuple[float, float]:
    """Forward in wide curves, with a stop of a second in every five."""
    if seconds % 5.0 < 1.0:
        return 0.0, 0.0
    turn = 0.05 * math.sin(seconds)
    return 0.25 - turn, 0.25 + turn


@pytest.mark.parametrize(
    ("bit_errors", "lost_frames", "seconds", "minimum_path"),
    [(0.001, 0.2, 120, 15.0), pytest.param(0.01, 0.2, 120, 0.3, marks=pytest.mark.slow)],
)
@pytest.mark.slow
def test_a_noisy_line_causes_no_motion_and_loses_no_ticks(
    bit_errors: float, lost_frames: float, seconds: int, minimum_path: float
) -> None:
    """One bit in a hundred leaves one line in twenty whole: the robot stands most of the time, but knows where."""
    rig = Rig(bits_and_frames(bit_errors, lost_frames), seed=5)
    for _ in range(50):
        rig.step((0.0, 0.0))
    assert rig.session.is_open and rig.lines > 10
    rig.disturbed = True
    for n in range(seconds * 100):
        wanted = weave(n / 100.0)
        rig.step(wanted)
        maximum = round(0.31 / METRES)
        assert all(-1 <= speed <= maximum for speed in rig.speeds)
    driven = rig.path
    rig.disturbed = False
    for _ in range(200):
        rig.step((0.0, 0.0))
    assert driven > minimum_path
    assert rig.error < 0.01 * driven


def test_noise_alone_causes_no_motion() -> None:
    """A session is open and stands; then the wire turns every second bit, and lines come damaged and doubled."""
    rig = Rig(bits_and_frames(0.5, 0.0), seed=6)
    for _ in range(50):
        rig.step((0.0, 0.0))
    rig.disturbed = True
    for _ in range(3000):
        rig.board.write(rig.chance.randbytes(20))
        rig.step((0.2, 0.2))
        assert rig.speeds == (0, 0)

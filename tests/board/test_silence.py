"""Nobody commands any more: how long wheels obey the last command, in the board's own time."""

from __future__ import annotations

import pytest
from tests.firmware.host_board import HostBoard

from chefbot.board import BoardSession
from chefbot.control.kinematics import wheel_speeds
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed

ROBOT = load_robot("chefbot")
MS = 1_000_000
BYTE_US = 87
"""On the wire, at 115200 baud."""


class Line:
    """Session and board, a millisecond at a time; bytes need theirs on the wire."""

    def __init__(self, send_phase_ms: int) -> None:
        self.board, self.session, self._phase = HostBoard(), BoardSession(ROBOT), send_phase_ms
        self.ms = 0
        self._wire: list[tuple[int, bytes]] = []

    def send(self, data: bytes) -> None:
        begin = max(self.ms * 1000, self._wire[-1][0] if self._wire else 0)
        if data:
            self._wire.append((begin + len(data) * BYTE_US, data))

    def step(self, driver_lives: bool = True) -> None:
        if driver_lives and self.ms % 20 == self._phase:
            self.send(self.session.data_to_send(self.ms * MS))
        while self._wire and self._wire[0][0] <= self.ms * 1000:
            self.board.write(self._wire.pop(0)[1])
        if self.ms % 10 == 0:
            self.board.set_imu_at_rest()
        for wheel in (0, 1):
            self.board.lib.chefbot_board_turn(self.board.handle, wheel, self.board.state.set[wheel] // 1000)
        self.board.lib.chefbot_board_advance(self.board.handle, 1000)
        self.ms += 1
        self.session.receive_data(self.board.read(), self.ms * MS)

    @property
    def drives(self) -> bool:
        return any(self.board.state.duty)


@pytest.mark.parametrize("phase", range(0, 20, 3))
@pytest.mark.parametrize("driver_lives", [True, False])
def test_the_last_command_expires_after_200_ms(phase: int, driver_lives: bool) -> None:
    """With nodes at 20 Hz and a driver that sends at 50 Hz in every phase to them."""
    line = Line(phase)
    for ms in range(900):
        if ms % 50 == 0:
            speed = max_speed(ROBOT) if ms >= 400 else 0.0
            line.send(line.session.command(*wheel_speeds(speed, 0.0, ROBOT), line.ms * MS))
        line.step()
    assert line.drives
    line.send(line.session.command(*wheel_speeds(max_speed(ROBOT), 0.0, ROBOT), line.ms * MS))
    last = line.ms
    while line.drives and line.ms < last + 1000:
        line.step(driver_lives)
    assert line.ms - last <= 200
    for _ in range(500):
        line.step(driver_lives)
        assert not line.drives

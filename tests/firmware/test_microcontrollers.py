"""Tests that the programs for ATmega2560 (simavr) and RP2040 (rp2040js) behave as the host build does."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from chefbot.board.firmware_constants import firmware_constants
from tests.firmware.emulators import BoardEmulator, MegaEmulator, PicoAtUsb, PicoEmulator
from tests.firmware.host_board import HostBoard
from tests.firmware.serial_lines import Message, add_checksum, parse_message
from tests.support.wirings import wired

PHASE_MS = 3.0
"""Time after a control step at which the emulator starts and inputs change."""
STEP_CYCLES = 250 * 16
"""250 us at 16 MHz."""


@pytest.fixture(params=[MegaEmulator, PicoEmulator, PicoAtUsb])
def emulator(request: pytest.FixtureRequest) -> Iterator[BoardEmulator]:
    board = request.param()
    yield board
    board.close()


class EmulatorAndHost:
    """An emulator and the host build with the same inputs, at the same time after the same control step."""

    def __init__(self, emulator: BoardEmulator) -> None:
        self.emulator = emulator
        self.host = HostBoard({c.name: c.value for c in firmware_constants(emulator.robot)})
        self.duties: list[tuple[tuple[int, ...], tuple[int, ...]]] = []
        self.host_sent = b""
        self._battery_next = 0
        lib, handle = self.host.lib, self.host.handle
        lib.chefbot_board_echo(handle, 0)
        lib.chefbot_board_battery(handle, emulator.battery_mv(emulator.battery_adc))
        lib.chefbot_board_power_cycle(handle)
        lib.chefbot_board_imu(
            handle, (lib.chefbot_board_imu.argtypes[1]._type_ * 7)(0, 0, 8192, -3920, 0, 0, 0)
        )
        steps = emulator.run(0).steps  # more than one where a USB host was waited for
        lib.chefbot_board_advance(handle, int(steps * 10_000 + PHASE_MS * 1000))

    def write(self, data: bytes) -> None:
        self.host.write(data)
        self.emulator.write(data)

    def turn(self, wheel: int, quarter_steps: int) -> None:
        self.host.lib.chefbot_board_turn(self.host.handle, wheel, quarter_steps)
        self.emulator.request(f"turn {wheel} {quarter_steps}")

    def set(self, name: str, value: int) -> None:
        getattr(self.host.lib, f"chefbot_board_{name}")(self.host.handle, value)
        self.emulator.request(f"{name} {value}")

    def battery(self, adc: int) -> None:
        """Set the voltage of a converter reading, so that both have the same millivolts; the host a step later."""
        self._battery_next = self.emulator.battery_mv(adc)
        self.emulator.request(f"battery {self.emulator.battery_command(adc)}")

    def imu(self, *raw: int) -> None:
        self.host.imu(*raw)
        self.emulator.request("imu " + " ".join(map(str, raw)))

    def step(self) -> None:
        self.host.lib.chefbot_board_advance(self.host.handle, 10_000)
        self.host_sent += self.host.read()
        if self._battery_next:
            self.host.lib.chefbot_board_battery(self.host.handle, self._battery_next)
        state = self.emulator.run(10_000)
        self.duties.append((tuple(map(self.emulator.readable_duty, self.host.state.duty)), state.duty))

    def compared(self) -> tuple[list[Message], list[Message]]:
        """Return the messages of host and emulator, without the last that the slower line has not sent yet."""
        sent = self.emulator.sent[: self.emulator.sent.rfind(b"\n") + 1]
        of_emulator = [_without_port_name(parse_message(line)) for line in sent.splitlines()]
        of_host = [_without_port_name(parse_message(line)) for line in self.host_sent.splitlines()]
        assert abs(len(of_host) - len(of_emulator)) < 12
        both = min(len(of_host), len(of_emulator))
        return of_host[:both], of_emulator[:both]


def echoes_agree(here: Message, there: Message, jitter_us: int) -> bool:
    """Return whether two echo messages differ by at most `jitter_us`, as the emulator measures the pulse."""
    same = (here.letter, here.sequence, here.fields[0]) == (there.letter, there.sequence, there.fields[0])
    return here.letter == "u" and same and abs(int(here.fields[1]) - int(there.fields[1])) <= jitter_us


def _without_port_name(message: Message) -> Message:
    """Return the message without the name of the port, in which host and emulator differ."""
    if message.letter != "v":
        return message
    return message._replace(fields=message.fields[:3] + message.fields[4:])


def scenario(both: EmulatorAndHost, seconds: float, seed: int) -> None:
    """Run a drive with a motor model, emergency stop, corrupt lines, and failures of IMU, battery and echo."""
    rng = random.Random(seed)
    no_load = both.host.constants["no_load"]
    speed, position, ticks = [0.0, 0.0], [0.0, 0.0], [0, 0]
    target = (0, 0)
    sequence = 0
    full = both.emulator.battery_adc
    both.battery(full + full // 90)

    def send(letter: str, *numbers: int) -> None:
        nonlocal sequence
        sequence = (sequence + 1) % 65536
        both.write(add_checksum(" ".join([letter, str(sequence), *map(str, numbers)])))

    events: dict[int, Callable[[], object]] = {
        300: lambda: both.set("echo", 5832),
        340: lambda: both.set("estop", 1),
        360: lambda: both.set("estop", 0),
        370: lambda: send("c"),
        404: lambda: both.set("driver_fault", 1),
        410: lambda: both.set("driver_fault", 0),
        412: lambda: send("c"),
        520: lambda: both.write(b"garbage\xff\x00\n*1234\n"),
        560: lambda: both.set("imu_answers", 0),
        600: lambda: both.set("imu_answers", 1),
        640: lambda: both.set("echo", -1),
        700: lambda: both.write(add_checksum("x 3")),
        720: lambda: send("c"),
        800: lambda: both.battery(full * 9 // 10),
        1100: lambda: both.battery(full + full // 40),
        1300: lambda: send("c"),
    }
    for step in range(int(seconds * 100)):
        if step == 40:
            both.write(add_checksum("v 7 1"))
        if step == 45:
            answer = next(line for line in both.host_sent.splitlines() if line.startswith(b"v "))
            sequence = int(answer.split(b"*")[0].split(b" ")[-2])
        if step in events:
            events[step]()
        elif step >= 45 and step % 5 == 0 and not 430 < step < 470:
            if step % 100 == 50:
                target = (rng.randint(-no_load, no_load), rng.randint(-no_load, no_load))
            send("s", *((0, 0) if step % 100 == 0 else target))
        for wheel in (0, 1):
            duty = both.host.state.duty[wheel] / 1000.0
            speed[wheel] += (duty * 0.95 * no_load - speed[wheel]) * (1 - math.exp(-0.01 / 0.13))
            position[wheel] += speed[wheel] * 0.01
            both.turn(wheel, math.floor(position[wheel]) - ticks[wheel])
            ticks[wheel] = math.floor(position[wheel])
        noise = [rng.randint(-3, 3) for _ in range(6)]
        yaw_rate = int((speed[1] - speed[0]) / no_load * 4000)
        both.imu(noise[0], noise[1], 8192 + noise[2], -3920, noise[3], noise[4], yaw_rate + noise[5])
        both.step()


@pytest.mark.rotated("drives of microcontrollers")
@pytest.mark.slow
def test_microcontrollers_reproduce_ticks_states_and_messages(emulator: BoardEmulator) -> None:
    both = EmulatorAndHost(emulator)
    scenario(both, 16.0, seed=5)
    of_host, of_emulator = both.compared()
    for here, there in zip(of_host, of_emulator, strict=True):
        assert here == there or echoes_agree(here, there, emulator.echo_jitter_us)
    assert {m.letter for m in of_emulator} == set("vesiubt")
    for step, (here, there) in enumerate(both.duties):
        assert here == there, step
    assert max(abs(duty[0]) for duty, _ in both.duties) > 300
    ticks = [int(m.fields[1]) for m in of_emulator if m.letter == "e"]
    assert max(ticks) - min(ticks) > 5000


@pytest.mark.parametrize(
    ("kind", "wiring"),
    [
        (MegaEmulator, "dir_pwm"),
        (MegaEmulator, "two_pwm"),
        (PicoEmulator, "dir_pwm"),
        (PicoEmulator, "two_pwm"),
        (PicoEmulator, "pins"),
    ],
)
@pytest.mark.rotated("drives of microcontrollers")
@pytest.mark.slow
def test_other_wirings_drive_the_motors_in_the_same_way(
    kind: type[MegaEmulator | PicoEmulator], wiring: str, tmp_path: Path
) -> None:
    board = kind(robot=wired(wiring, tmp_path))
    try:
        both = EmulatorAndHost(board)
        scenario(both, 6.0, seed=7)
        of_host, of_emulator = both.compared()
    finally:
        board.close()
    for here, there in zip(of_host, of_emulator, strict=True):
        assert here == there or echoes_agree(here, there, board.echo_jitter_us)
    for step, (here, there) in enumerate(both.duties):
        assert here == there, step
    assert max(abs(duty[0]) for duty, _ in both.duties) > 300
    assert {math.copysign(1, duty[1]) for duty, _ in both.duties if duty[1]} == {-1.0, 1.0}


@pytest.mark.rotated("limits of microcontrollers")
@pytest.mark.slow
def test_control_step_is_short_even_at_full_speed(
    emulator: BoardEmulator, record_property: Callable[[str, object], None]
) -> None:
    emulator.request("echo 5000")
    for step in range(60):
        emulator.set_imu_at_rest()
        if step == 5:
            emulator.open_session()
        emulator.send_command("s", 5000 if step > 20 else 0, -5000 if step > 20 else 0)
        for wheel in (0, 1):
            emulator.request(
                f"turn {wheel} {60 if wheel else -60}"
            )  # 60 edges within 6 ms, close to the 112 per step of full speed
        state = emulator.run(10_000)
    record_property("longest_step_cycles", state.longest_step)
    assert 500 < state.longest_step <= STEP_CYCLES


@pytest.mark.rotated("limits of microcontrollers")
@pytest.mark.slow
def test_no_encoder_edge_is_lost_at_full_speed(emulator: BoardEmulator) -> None:
    for edges in (112, -112, 112):
        for _ in range(20):
            for wheel in (0, 1):
                emulator.request(f"turn {wheel} {edges if wheel else -edges}")
            emulator.run(10_000)
    emulator.run(100_000)
    messages = [parse_message(line) for line in emulator.sent[: emulator.sent.rfind(b"\n")].splitlines()]
    motion = [m for m in messages if m.letter == "e"][-1]
    assert (int(motion.fields[1]), int(motion.fields[2])) == (-2240, 2240)
    status = [m for m in messages if m.letter == "s"][-1]
    assert status.fields[-2:] == ("0", "0")


@pytest.mark.rotated("limits of microcontrollers")
@pytest.mark.parametrize("offset_us", [1700, 8100])
@pytest.mark.slow
def test_a_silent_computer_stops_the_motors_in_150_ms(emulator: BoardEmulator, offset_us: int) -> None:
    for _ in range(30):
        emulator.set_imu_at_rest()
        emulator.run(10_000)
    emulator.open_session()
    emulator.send_command("s", 0, 0)
    emulator.run(10_000)
    for _ in range(20):
        emulator.send_command("s", 4000, 4000)
        for _ in range(4):
            emulator.request("turn 0 30")
            emulator.request("turn 1 30")
            emulator.set_imu_at_rest()
            emulator.run(10_000)
    emulator.run(offset_us)
    emulator.send_command("s", 4000, 4000)
    for _ in range(13):
        emulator.request("turn 0 30")
        emulator.request("turn 1 30")
        state = emulator.run(10_000)
        assert state.duty[0] > 0 and state.duty[1] > 0
    state = emulator.run(20_000 + 3_000)  # 150 ms and the transmission time of the command
    assert state.duty == (0, 0)


@pytest.mark.rotated("limits of microcontrollers")
@pytest.mark.slow
def test_a_hanging_i2c_bus_does_not_block_the_board(emulator: BoardEmulator) -> None:
    emulator.request("imu_answers 0")
    first = emulator.run(10_000)
    last = emulator.run(1_000_000)
    assert last.steps - first.steps == 100
    assert sum(line.startswith(b"e ") for line in emulator.sent.splitlines()) >= 50

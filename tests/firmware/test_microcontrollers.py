"""The programs of ATmega2560 (simavr) and Pico (rp2040js): each does what the host build does, and stops alone."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator

import pytest

from tests.firmware.benches import Bench, Mega, Pico
from tests.firmware.host_board import HostBoard
from tests.firmware.lines import Message, framed, unframed

PHASE_MS = 3.0
"""The bench starts so long after the first control step, and changes inputs there."""
STEP_CYCLES = 250 * 16
"""250 us at 16 MHz."""


@pytest.fixture(params=[Mega, Pico])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    board = request.param()
    yield board
    board.close()


class Both:
    """The same inputs to both, at the same time after the same control step."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.host = HostBoard()
        self.duties: list[tuple[tuple[int, ...], tuple[int, ...]]] = []
        self.host_said = b""
        self._battery_next = 0
        lib, handle = self.host.lib, self.host.handle
        lib.chefbot_board_echo(handle, 0)
        lib.chefbot_board_battery(handle, bench.battery_mv(bench.battery_adc))
        lib.chefbot_board_power_cycle(handle)
        lib.chefbot_board_imu(
            handle, (lib.chefbot_board_imu.argtypes[1]._type_ * 7)(0, 0, 8192, -3920, 0, 0, 0)
        )
        lib.chefbot_board_advance(handle, int(10_000 + PHASE_MS * 1000))

    def write(self, data: bytes) -> None:
        self.host.write(data)
        self.bench.write(data)

    def turn(self, wheel: int, quarter_steps: int) -> None:
        self.host.lib.chefbot_board_turn(self.host.handle, wheel, quarter_steps)
        self.bench.ask(f"turn {wheel} {quarter_steps}")

    def set(self, name: str, value: int) -> None:
        getattr(self.host.lib, f"chefbot_board_{name}")(self.host.handle, value)
        self.bench.ask(f"{name} {value}")

    def battery(self, adc: int) -> None:
        """In steps of the converter, so that both read the same millivolts; a converter's is read a step later."""
        self._battery_next = self.bench.battery_mv(adc)
        self.bench.ask(f"battery {self.bench.battery_command(adc)}")

    def imu(self, *raw: int) -> None:
        self.host.imu(*raw)
        self.bench.ask("imu " + " ".join(map(str, raw)))

    def step(self) -> None:
        self.host.lib.chefbot_board_advance(self.host.handle, 10_000)
        self.host_said += self.host.read()
        if self._battery_next:
            self.host.lib.chefbot_board_battery(self.host.handle, self._battery_next)
        state = self.bench.run(10_000)
        self.duties.append((tuple(map(self.bench.readable_duty, self.host.state.duty)), state.duty))

    def compared(self) -> tuple[list[Message], list[Message]]:
        """Messages of both; the bench's serial line is a few behind."""
        said = self.bench.said[: self.bench.said.rfind(b"\n") + 1]
        theirs = [_anonymous(unframed(line)) for line in said.splitlines()]
        ours = [_anonymous(unframed(line)) for line in self.host_said.splitlines()]
        assert 0 <= len(ours) - len(theirs) < 12
        return ours[: len(theirs)], theirs


def echoes_agree(here: Message, there: Message, jitter_us: int) -> bool:
    """The one thing that is measured and not given: the width of a pulse."""
    same = (here.letter, here.sequence, here.fields[0]) == (there.letter, there.sequence, there.fields[0])
    return here.letter == "u" and same and abs(int(here.fields[1]) - int(there.fields[1])) <= jitter_us


def _anonymous(message: Message) -> Message:
    """Without the name of the port."""
    if message.letter != "v":
        return message
    return message._replace(fields=message.fields[:3] + message.fields[4:])


def scenario(both: Both, seconds: float, seed: int) -> None:
    """A drive with a motor model, and everything that can go wrong."""
    chance = random.Random(seed)
    no_load = both.host.constants["no_load"]
    speed, place, told = [0.0, 0.0], [0.0, 0.0], [0, 0]
    target = (0, 0)
    sequence = 0
    full = both.bench.battery_adc
    both.battery(full + full // 90)

    def say(letter: str, *numbers: int) -> None:
        nonlocal sequence
        sequence = (sequence + 1) % 65536
        both.write(framed(" ".join([letter, str(sequence), *map(str, numbers)])))

    events: dict[int, Callable[[], object]] = {
        300: lambda: both.set("echo", 5832),
        340: lambda: both.set("estop", 1),
        360: lambda: both.set("estop", 0),
        370: lambda: say("c"),
        520: lambda: both.write(b"garbage\xff\x00\n*1234\n"),
        560: lambda: both.set("imu_answers", 0),
        600: lambda: both.set("imu_answers", 1),
        640: lambda: both.set("echo", -1),
        700: lambda: both.write(framed("x 3")),
        720: lambda: say("c"),
        800: lambda: both.battery(full * 9 // 10),
        1100: lambda: both.battery(full + full // 40),
        1300: lambda: say("c"),
    }
    for step in range(int(seconds * 100)):
        if step == 40:
            both.write(framed("v 7 1"))
        if step == 45:
            answer = next(line for line in both.host_said.splitlines() if line.startswith(b"v "))
            sequence = int(answer.split(b"*")[0].split(b" ")[-2])
        if step in events:
            events[step]()
        elif step >= 45 and step % 5 == 0 and not 430 < step < 470:
            if step % 100 == 50:
                target = (chance.randint(-no_load, no_load), chance.randint(-no_load, no_load))
            say("s", *((0, 0) if step % 100 == 0 else target))
        for wheel in (0, 1):
            duty = both.host.state.duty[wheel] / 1000.0
            speed[wheel] += (duty * 0.95 * no_load - speed[wheel]) * (1 - math.exp(-0.01 / 0.13))
            place[wheel] += speed[wheel] * 0.01
            both.turn(wheel, math.floor(place[wheel]) - told[wheel])
            told[wheel] = math.floor(place[wheel])
        noise = [chance.randint(-3, 3) for _ in range(6)]
        turning = int((speed[1] - speed[0]) / no_load * 4000)
        both.imu(noise[0], noise[1], 8192 + noise[2], -3920, noise[3], noise[4], turning + noise[5])
        both.step()


@pytest.mark.slow
def test_microcontrollers_reproduce_ticks_states_and_messages(bench: Bench) -> None:
    both = Both(bench)
    scenario(both, 16.0, seed=5)
    ours, theirs = both.compared()
    for here, there in zip(ours, theirs, strict=True):
        assert here == there or echoes_agree(here, there, bench.echo_jitter_us)
    assert {m.letter for m in theirs} == set("vesiubt")
    for step, (here, there) in enumerate(both.duties):
        assert here == there, step
    assert max(abs(duty[0]) for duty, _ in both.duties) > 300
    ticks = [int(m.fields[1]) for m in theirs if m.letter == "e"]
    assert max(ticks) - min(ticks) > 5000


def test_control_step_is_short_even_at_full_speed(
    bench: Bench, record_property: Callable[[str, object], None]
) -> None:
    bench.ask("echo 5000")
    for step in range(60):
        bench.live_imu()
        if step == 5:
            bench.shake_hands()
        bench.say("s", 5000 if step > 20 else 0, -5000 if step > 20 else 0)
        for wheel in (0, 1):
            bench.ask(f"turn {wheel} {60 if wheel else -60}")  # of 112 at full speed, in 6 ms: no slower pace
        state = bench.run(10_000)
    record_property("longest_step_cycles", state.longest_step)
    assert 500 < state.longest_step <= STEP_CYCLES


@pytest.mark.slow
def test_no_encoder_edge_is_lost_at_full_speed(bench: Bench) -> None:
    for way in (112, -112, 112):
        for _ in range(20):
            for wheel in (0, 1):
                bench.ask(f"turn {wheel} {way if wheel else -way}")
            bench.run(10_000)
    bench.run(100_000)
    messages = [unframed(line) for line in bench.said[: bench.said.rfind(b"\n")].splitlines()]
    motion = [m for m in messages if m.letter == "e"][-1]
    assert (int(motion.fields[1]), int(motion.fields[2])) == (-2240, 2240)
    status = [m for m in messages if m.letter == "s"][-1]
    assert status.fields[-2:] == ("0", "0")


@pytest.mark.parametrize("offset_us", [1700, 8100])
def test_a_silent_computer_stops_the_motors_in_150_ms(bench: Bench, offset_us: int) -> None:
    for _ in range(30):
        bench.live_imu()
        bench.run(10_000)
    bench.shake_hands()
    bench.say("s", 0, 0)
    bench.run(10_000)
    for _ in range(20):
        bench.say("s", 4000, 4000)
        for _ in range(4):
            bench.ask("turn 0 30")
            bench.ask("turn 1 30")
            bench.live_imu()
            bench.run(10_000)
    bench.run(offset_us)
    bench.say("s", 4000, 4000)
    for _ in range(13):
        bench.ask("turn 0 30")
        bench.ask("turn 1 30")
        state = bench.run(10_000)
        assert state.duty[0] > 0 and state.duty[1] > 0
    state = bench.run(20_000 + 3_000)  # 150 ms, and what the line takes to carry the command
    assert state.duty == (0, 0)


def test_a_hanging_i2c_bus_does_not_block_the_board(bench: Bench) -> None:
    bench.ask("imu_answers 0")
    first = bench.run(10_000)
    last = bench.run(1_000_000)
    assert last.steps - first.steps == 100
    assert sum(line.startswith(b"e ") for line in bench.said.splitlines()) >= 50

"""What is wired to the motor board of a robot: modules with their terminals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from chefbot.design.sizing.requirements import LOGIC_SHARE
from chefbot.design.wiring.board_pins import BoardPins
from chefbot.robot.board import BOARD_LOGIC
from chefbot.robot.spec import Robot

SIDES = ("LEFT", "RIGHT")
FIVE_VOLTS = 5.0
CUTS_ENABLE = "All grounds are joined. The e-stop's second contact cuts the drivers' enable by itself."
CUTS_SUPPLY = (
    "All grounds are joined. The drivers have no enable: the e-stop's second contact must cut their supply."
)
EN_DIAG_CUTS_SUPPLY = (
    "All grounds are joined. EN/DIAG is pulled up on the driver's board: no pull-down, and the e-stop's second "
    "contact must cut the drivers' supply."
)
BACKWARDS = "A wheel that runs backwards: swap its motor leads; an encoder fault at once: swap its A and B."
BOARD_NOTES = {
    "mega": "The IMU is a module with a regulator; the Mega pulls SDA and SCL up to 5 V: use a level shifter.",
    "tiva": "The Launchpad's encoder inputs stand 5 V. Take off R9 and R10: they join PB6/PB7 to PD0/PD1.",
}
"""What no wire shows, by the kind of the motor board."""


class Module(NamedTuple):
    """A module: its title, its supply, and (signal of the board, name of the terminal) of each wire."""

    title: str
    supply: str
    wires: tuple[tuple[str, str], ...]


class Wiring(NamedTuple):
    """All that is wired to a motor board; `divided`: inputs that get 5 V through a divider of 1k and 2k."""

    kind: str
    board: BoardPins
    left: tuple[Module, ...]
    right: tuple[Module, ...]
    divided: frozenset[str]
    notes: tuple[str, ...]


def wiring_of(robot: Robot, kind: str, board: BoardPins) -> Wiring:
    """Return the wiring of a robot with a kind of motor board: sensors on the left, motors on the right."""
    logic = BOARD_LOGIC[kind]
    left, right = tuple(_sensors(robot, logic)), tuple(_actuators(robot, board, logic))
    divided: frozenset[str] = frozenset()
    if logic < FIVE_VOLTS:
        encoders = [f"{side}_{line}" for side in SIDES for line in "AB"]
        divided = frozenset(["ECHO", *(() if board.five_volt_encoders else encoders)])
    return Wiring(kind, board, left, right, divided, tuple(_notes(robot, kind, logic, divided)))


def _sensors(robot: Robot, logic: float) -> Iterator[Module]:
    for side in SIDES:
        yield Module(f"{side.title()} encoder", "5 V, GND", ((f"{side}_A", "A"), (f"{side}_B", "B")))
    supply = f"{logic:g} V, GND"
    yield Module("MPU-6050, address 0x68", f"{supply}, AD0 to GND", (("SDA", "SDA"), ("SCL", "SCL")))
    if robot.sensors.ultrasonic is not None:
        yield Module("HC-SR04", "5 V, GND", (("TRIGGER", "Trig"), ("ECHO", "Echo")))
    if count := len(robot.sensors.cliff_sensors):
        yield Module("Cliff sensors", supply, tuple((f"CLIFF_{i}", f"{i}") for i in range(count)))


def _actuators(robot: Robot, board: BoardPins, logic: float) -> Iterator[Module]:
    voltage = f"{robot.battery.voltage:g} V"
    for side, signals in zip(SIDES, board.two_pwm, strict=True):
        wires = {
            "ina_inb_pwm": ((f"{side}_IN_A", "INA"), (f"{side}_IN_B", "INB"), (f"PWM_{side}", "PWM")),
            "dir_pwm": ((f"{side}_IN_A", "DIR"), (f"PWM_{side}", "PWM")),
            "two_pwm": tuple(zip(signals, ("IN1, RPWM", "IN2, LPWM"), strict=True)),
        }[robot.driver.inputs]
        yield Module(f"{side.title()} motor's driver", f"{voltage}, logic {logic:g} V, GND; motor", wires)
    if robot.driver.enable_diag:
        yield Module("Both drivers", "joined; a driver's fault is read here", (("ENABLE", "EN/DIAG"),))
    elif robot.driver.enable:
        yield Module("Both drivers", "enable, pulled down", (("ENABLE", "EN, STBY or SLP"),))
    yield Module("E-stop", "normally closed, to GND", (("ESTOP", "NC"),))
    yield Module(f"Battery {voltage}", "+ to drivers, - to GND", (("BATTERY", "+"),))
    yield Module("Computer (serial)", board.computer, (("TX", "RX"), ("RX", "TX")))


def _notes(robot: Robot, kind: str, logic: float, divided: frozenset[str]) -> Iterator[str]:
    """Yield what no wire shows."""
    driver = robot.driver
    boards = ", one for each motor" if driver.channels == 1 else ""
    forward = {"ina_inb_pwm": "INA", "dir_pwm": "DIR", "two_pwm": "IN1"}[driver.inputs]
    yield f"Drivers: {driver.title}{boards}. Forward is {forward} high. {BACKWARDS}"
    yield EN_DIAG_CUTS_SUPPLY if driver.enable_diag else CUTS_ENABLE if driver.enable else CUTS_SUPPLY
    if driver.logic_high_min > LOGIC_SHARE * logic:
        yield f"The driver reads {driver.logic_high_min:g} V and more as high: put a level shifter between."
    if robot.battery.full_voltage > driver.voltage_max:
        yield (
            f"The full battery has {robot.battery.full_voltage:g} V, the driver stands {driver.voltage_max:g} V:"
            " use another one."
        )
    if divided:
        yield "5 V signals reach 3.3 V inputs through 1k and 2k to ground: 5 V x 2 / 3 = 3.33 V."
    if kind in BOARD_NOTES:
        yield BOARD_NOTES[kind]

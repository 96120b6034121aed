"""A wiring picture per motor board, drawn from the pin table in its port's source.

python docs/wiring.py
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape

ROOT = Path(__file__).parents[1]
PORTS = ROOT / "firmware" / "ports"
PICTURES = Path(__file__).parent / "pictures"
MEGA_PINS = {
    "PE0": "0", "PE1": "1", "PE4": "2", "PE5": "3", "PD3": "18", "PD2": "19", "PD1": "20", "PD0": "21",
    "PA0": "22", "PA1": "23", "PA2": "24", "PA3": "25", "PA4": "26", "PA6": "28", "PC7": "30", "PL0": "49",
    "PC0": "37", "PB5": "11", "PB6": "12", "PB7": "13", "PF0": "A0",
}  # fmt: skip
"""What is printed on an Arduino Mega 2560 beside the chip's pins."""


class Kind(NamedTuple):
    """A motor board."""

    folder: str
    title: str
    logic: str
    """Supply of what speaks to its pins."""
    divided: frozenset[str]
    """Inputs that get 5 V through 1k/2k."""
    computer: str


ECHO_ONLY, FIVE_VOLTS = frozenset({"ECHO"}), frozenset({"ECHO", "LEFT_A", "LEFT_B", "RIGHT_A", "RIGHT_B"})
BOARDS = {
    "mega": Kind("arduino_mega", "Arduino Mega 2560", "5 V", frozenset(), "USB has these two"),
    "tiva": Kind(
        "tiva_launchpad", "Tiva C Launchpad EK-TM4C123GXL", "3.3 V", ECHO_ONLY, "debug USB has these two"
    ),
    "pico": Kind("pico", "Raspberry Pi Pico", "3.3 V", FIVE_VOLTS, "USB-serial cable, 3.3 V"),
}


class Module(NamedTuple):
    """What is wired to the board: its terminals by the names of the pin table."""

    title: str
    supply: str
    pins: tuple[tuple[str, str], ...]
    """Name in the pin table, name on the module."""


def modules(kind: Kind) -> tuple[tuple[Module, ...], tuple[Module, ...]]:
    """Left and right of the board."""
    encoder = (("{}_A", "A"), ("{}_B", "B"))
    motor = (("{}_IN_A", "INA"), ("{}_IN_B", "INB"), ("PWM_{}", "PWM"))
    left = [
        Module(
            f"{side.title()} encoder", "5 V, GND", tuple((pin.format(side), name) for pin, name in encoder)
        )
        for side in ("LEFT", "RIGHT")
    ]
    left += [
        Module("MPU-6050, address 0x68", f"{kind.logic}, GND, AD0 to GND", (("SDA", "SDA"), ("SCL", "SCL"))),
        Module("HC-SR04", "5 V, GND", (("TRIGGER", "Trig"), ("ECHO", "Echo"))),
        Module("Cliff sensors, next pins: 1 to 3", f"{kind.logic}, GND", (("CLIFF_0", "0"),)),
    ]
    right = [
        Module(
            f"{side.title()} motor's driver",
            f"12 V, logic {kind.logic}, GND; motor",
            tuple((pin.format(side), name) for pin, name in motor),
        )
        for side in ("LEFT", "RIGHT")
    ]
    right += [
        Module("Both drivers", "enable, pulled down", (("ENABLE", "EN"),)),
        Module("E-stop", "normally closed, to GND", (("ESTOP", "NC"),)),
        Module("Battery 12 V", "+ to drivers, - to GND", (("BATTERY", "+"),)),
        Module("Computer (serial)", kind.computer, (("TX", "RX"), ("RX", "TX"))),
    ]
    return tuple(left), tuple(right)


def source(kind: Kind) -> str:
    """The port's program."""
    return (PORTS / kind.folder / "main.cpp").read_text()


def pins(name: str) -> dict[str, str]:
    """Signal to the name that is printed on the board, from the port's pin table."""
    (table,) = re.findall(r"enum Pin : uint\d+_t \{(.*?)\}", source(BOARDS[name]), re.S)
    found = dict(re.findall(r"(\w+) = ([A-Z0-9 +]+?)\s*(?:,|$)", table.strip()))
    return {signal: _printed(name, place) for signal, place in found.items()}


def _printed(name: str, place: str) -> str:
    if name == "mega":
        return MEGA_PINS[place]
    return "P" + place.replace(" + ", "") if name == "tiva" else f"GP{place}"


def battery_divider(name: str) -> tuple[str, str]:
    """Upper and lower resistor, from the line that turns the reading into millivolts."""
    (found,) = re.findall(r"through (\d+k)/(\d+k)", source(BOARDS[name]))
    return found[0], found[1]


# ---- drawing: an SVG, written by hand so that the same table gives the same bytes

WIDTH, TOP, ROW, GAP = 940, 70, 34, 34
LEFT_MODULE, BOARD, RIGHT_MODULE = (20, 210), (400, 560), (740, 920)
STYLE = """<style>text{font:13px sans-serif;fill:#222}.t{font-weight:bold}.s{font-size:11px;fill:#555}
.b{font-size:17px;font-weight:bold}.m{fill:#f4f1e8;stroke:#555}.k{fill:#e3eef6;stroke:#246}.w{stroke:#246;fill:none;stroke-width:1.6}.r{fill:#fff;stroke:#a33}
.n{fill:#246}.a{font-size:11px;fill:#a33}</style>"""


class Sheet:
    """Shapes, top to bottom."""

    def __init__(self) -> None:
        self.parts: list[str] = []

    def text(self, x: float, y: float, words: str, style: str = "", anchor: str = "start") -> None:
        """One line."""
        self.parts.append(
            f'<text x="{x:g}" y="{y:g}" class="{style}" text-anchor="{anchor}">{escape(words)}</text>'
        )

    def box(self, x: tuple[float, float], y: tuple[float, float], style: str) -> None:
        """From corner to corner."""
        size = f'width="{x[1] - x[0]:g}" height="{y[1] - y[0]:g}" rx="5"'
        self.parts.append(f'<rect x="{x[0]:g}" y="{y[0]:g}" {size} class="{style}"/>')

    def wire(self, *points: tuple[float, float]) -> None:
        """Through points."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.parts.append(f'<polyline points="{path}" class="w"/>')

    def to_ground(self, x: float, y: float, ohms: str) -> None:
        """A resistor from a node down to ground."""
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="3" class="n"/>')
        self.wire((x, y), (x, y + 8))
        self.box((x - 5, x + 5), (y + 8, y + 28), "r")
        self.text(x + 9, y + 23, ohms, "a")
        self.wire((x, y + 28), (x, y + 34))
        for half, down in ((8, 34), (5, 37), (2, 40)):
            self.wire((x - half, y + down), (x + half, y + down))

    def series(self, x: float, y: float, ohms: str) -> None:
        """A resistor in a wire, above which its value stands."""
        self.box((x - 13, x + 13), (y - 5, y + 5), "r")
        self.text(x, y - 8, ohms, "a", "middle")


def heights(kind: Kind, one: Module) -> list[float]:
    """Of a module's terminals: what hangs on a wire needs room below it."""
    extra = {"ENABLE": 24.0, "BATTERY": 24.0}
    return [ROW + (24.0 if pin in kind.divided else extra.get(pin, 0.0)) for pin, _ in one.pins]


def draw(name: str) -> str:
    """The board in the middle, sensors on its left, what moves and feeds it on its right."""
    kind, sheet = BOARDS[name], Sheet()
    sides = modules(kind)
    ends = [_side(sheet, name, side, left) for side, left in zip(sides, (True, False), strict=True)]
    bottom = max(ends)
    board = Sheet()
    board.box(BOARD, (TOP - 14, bottom), "k")
    board.text(sum(BOARD) / 2, TOP + 4, kind.title.split(" EK")[0], "t", "middle")
    notes = _notes(name, kind)
    height = bottom + 30 + 18 * len(notes)
    size = f'width="{WIDTH}" height="{height:g}" viewBox="0 0 {WIDTH} {height:g}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    board.text(20, 32, f"Wiring: {kind.title}", "b")
    for line, words in enumerate(notes):
        board.text(20, bottom + 28 + 18 * line, words, "s")
    paper = '<rect width="100%" height="100%" fill="#fff"/>'
    return "\n".join([head, STYLE, paper, *board.parts, *sheet.parts, "</svg>"]) + "\n"


def _side(sheet: Sheet, name: str, side: tuple[Module, ...], left: bool) -> float:
    """All modules of a side; where they end."""
    kind, y = BOARDS[name], TOP + 20.0
    x = LEFT_MODULE if left else RIGHT_MODULE
    for one in side:
        tall = heights(kind, one)
        sheet.box(x, (y, y + 40 + sum(tall) - 6), "m")
        sheet.text(x[0] + 10, y + 18, one.title, "t")
        sheet.text(x[0] + 10, y + 33, one.supply, "s")
        row = y + 52
        for (pin, terminal), height in zip(one.pins, tall, strict=True):
            _terminal(sheet, name, pin, terminal, row, left)
            row += height
        y += 40 + sum(tall) - 6 + GAP - 16
    return y + 4


def _terminal(sheet: Sheet, name: str, pin: str, terminal: str, y: float, left: bool) -> None:
    """One wire with its two names, and what sits in it."""
    kind = BOARDS[name]
    module, board = (LEFT_MODULE[1], BOARD[0]) if left else (RIGHT_MODULE[0], BOARD[1])
    way = 1 if left else -1
    sheet.wire((module, y), (board, y))
    sheet.text(module - 8 * way, y + 4, terminal, "", "end" if left else "start")
    sheet.text(board + 8 * way, y + 4, f"{pins(name)[pin]}", "t", "start" if left else "end")
    if pin in kind.divided:
        sheet.series(module + 60, y, "1k")
        sheet.to_ground(module + 115, y, "2k")
    if pin == "ENABLE":
        sheet.to_ground(module - 115, y, "10k")
    if pin == "BATTERY":
        upper, lower = battery_divider(name)
        sheet.series(module - 60, y, upper)
        sheet.to_ground(module - 115, y, lower)


def _notes(name: str, kind: Kind) -> list[str]:
    """What no wire shows."""
    notes = [
        "Drivers: VNH5019 or VNH2SP30. All grounds are joined. "
        "The e-stop's second contact cuts the drivers' enable by itself, without any program.",
        "Positive duty is INA high. A wheel that runs backwards: swap its motor leads; "
        "an encoder fault at once: swap A and B.",
    ]
    if kind.divided:
        notes.append("5 V signals reach 3.3 V inputs through 1k and 2k to ground: 5 V x 2 / 3 = 3.33 V.")
    if name == "mega":
        notes.append(
            "The IMU is a module with a regulator; the Mega pulls SDA and SCL up to 5 V: put a level shifter between."
        )
    if name == "tiva":
        notes.append(
            "The Launchpad's encoder inputs stand 5 V. Take off R9 and R10: they join PB6/PB7 to PD0/PD1."
        )
    return notes


def main() -> None:
    """wiring_mega.svg, wiring_tiva.svg and wiring_pico.svg in docs/pictures."""
    for name in BOARDS:
        (PICTURES / f"wiring_{name}.svg").write_text(draw(name))


if __name__ == "__main__":
    main()

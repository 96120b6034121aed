"""The wiring of a motor board as a picture (SVG): the same wiring gives the same bytes."""

from __future__ import annotations

from xml.sax.saxutils import escape

from chefbot.design.wiring.modules import Module, Wiring

WIDTH, TOP, ROW, GAP = 940, 70, 34, 34
LEFT_MODULE, BOARD, RIGHT_MODULE = (20, 230), (400, 560), (720, 920)
"""Left and right edges of the columns, px."""
EXTRA_HEIGHT = 24.0
"""Height that a resistor to ground needs below its wire, px."""
LINE_LENGTH = 125
"""Longest line of the notes, characters."""
STYLE = """<style>text{font:13px sans-serif;fill:#222}.t{font-weight:bold}.s{font-size:11px;fill:#555}
.b{font-size:17px;font-weight:bold}.m{fill:#f4f1e8;stroke:#555}.k{fill:#e3eef6;stroke:#246}.w{stroke:#246;fill:none;stroke-width:1.6}.r{fill:#fff;stroke:#a33}
.n{fill:#246}.a{font-size:11px;fill:#a33}</style>"""


class Shapes:
    """The shapes of a picture, as SVG elements."""

    def __init__(self) -> None:
        self.parts: list[str] = []

    def text(self, x: float, y: float, text: str, style: str = "", anchor: str = "start") -> None:
        """Add a line of text."""
        self.parts.append(
            f'<text x="{x:g}" y="{y:g}" class="{style}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def box(self, x: tuple[float, float], y: tuple[float, float], style: str) -> None:
        """Add a box from corner to corner."""
        size = f'width="{x[1] - x[0]:g}" height="{y[1] - y[0]:g}" rx="5"'
        self.parts.append(f'<rect x="{x[0]:g}" y="{y[0]:g}" {size} class="{style}"/>')

    def wire(self, *points: tuple[float, float]) -> None:
        """Add a wire through points."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.parts.append(f'<polyline points="{path}" class="w"/>')

    def resistor_to_ground(self, x: float, y: float, ohms: str) -> None:
        """Add a resistor from a node down to ground."""
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="3" class="n"/>')
        self.wire((x, y), (x, y + 8))
        self.box((x - 5, x + 5), (y + 8, y + 28), "r")
        self.text(x + 9, y + 23, ohms, "a")
        self.wire((x, y + 28), (x, y + 34))
        for half, down in ((8, 34), (5, 37), (2, 40)):
            self.wire((x - half, y + down), (x + half, y + down))

    def resistor(self, x: float, y: float, ohms: str) -> None:
        """Add a resistor in a wire, with its value above."""
        self.box((x - 13, x + 13), (y - 5, y + 5), "r")
        self.text(x, y - 8, ohms, "a", "middle")


def wiring_picture(wiring: Wiring) -> str:
    """Return the SVG: the board in the middle, sensors on its left, motors and supply on its right."""
    shapes, board = Shapes(), Shapes()
    bottom = max(
        _draw_side(shapes, wiring, wiring.left, True), _draw_side(shapes, wiring, wiring.right, False)
    )
    board.box(BOARD, (TOP - 14, bottom), "k")
    board.text(sum(BOARD) / 2, TOP + 4, wiring.board.title.split(" EK")[0], "t", "middle")
    notes = [line for note in wiring.notes for line in _lines(note)]
    height = bottom + 30 + 18 * len(notes)
    size = f'width="{WIDTH}" height="{height:g}" viewBox="0 0 {WIDTH} {height:g}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    board.text(20, 32, f"Wiring: {wiring.board.title}", "b")
    for i, line in enumerate(notes):
        board.text(20, bottom + 28 + 18 * i, line, "s")
    paper = '<rect width="100%" height="100%" fill="#fff"/>'
    return "\n".join([head, STYLE, paper, *board.parts, *shapes.parts, "</svg>"]) + "\n"


def _lines(note: str) -> list[str]:
    """Break a note into lines between words."""
    lines = [""]
    for word in note.split():
        if len(lines[-1]) + len(word) > LINE_LENGTH:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return lines


def _heights(wiring: Wiring, module: Module) -> list[float]:
    """Return the height of each terminal of a module."""
    grounded = {"ENABLE", "BATTERY", *wiring.divided}
    return [ROW + EXTRA_HEIGHT * (signal in grounded) for signal, _ in module.wires]


def _draw_side(shapes: Shapes, wiring: Wiring, modules: tuple[Module, ...], left: bool) -> float:
    """Draw all modules of a side and return where they end, px."""
    y, x = TOP + 20.0, LEFT_MODULE if left else RIGHT_MODULE
    for module in modules:
        heights = _heights(wiring, module)
        shapes.box(x, (y, y + 40 + sum(heights) - 6), "m")
        shapes.text(x[0] + 10, y + 18, module.title, "t")
        shapes.text(x[0] + 10, y + 33, module.supply, "s")
        row = y + 52
        for (signal, terminal), height in zip(module.wires, heights, strict=True):
            _draw_wire(shapes, wiring, signal, terminal, row, left)
            row += height
        y += 40 + sum(heights) - 6 + GAP - 16
    return y + 4


def _draw_wire(shapes: Shapes, wiring: Wiring, signal: str, terminal: str, y: float, left: bool) -> None:
    """Draw a wire with the names at its ends and the resistors in it."""
    module, board = (LEFT_MODULE[1], BOARD[0]) if left else (RIGHT_MODULE[0], BOARD[1])
    way = 1 if left else -1
    shapes.wire((module, y), (board, y))
    shapes.text(module - 8 * way, y + 4, terminal, "", "end" if left else "start")
    shapes.text(board + 8 * way, y + 4, wiring.board.pins[signal], "t", "start" if left else "end")
    if signal in wiring.divided:
        shapes.resistor(module + 60, y, "1k")
        shapes.resistor_to_ground(module + 115, y, "2k")
    if signal == "ENABLE":
        shapes.resistor_to_ground(module - 115, y, "10k")
    if signal == "BATTERY":
        upper, lower = wiring.board.battery_divider
        shapes.resistor(module - 60, y, upper)
        shapes.resistor_to_ground(module - 115, y, lower)

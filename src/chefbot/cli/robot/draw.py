"""`chefbot robot draw`: drawing sheets of a robot's parts as DXF, PNG and PDF."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table

from chefbot.cli.robot.draw_picture import picture
from chefbot.design.drawing.dxf import dxf_bytes, dxf_document
from chefbot.design.drawing.paper import NAMES, Drawing
from chefbot.design.drawing.sheets import draw, selected_sheets
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import make_folder, write_atomic

console = Console(highlight=False)


def run_drawing(names: list[str], robot: str, out: Path) -> None:
    """Write NAME.dxf, .png and .pdf of every requested sheet, and print a list of them.

    Raises UserError for an unknown sheet or a folder that cannot be written.
    """
    model = load_robot(robot)
    sheets = selected_sheets(model, names)
    make_folder(out)
    table = Table("sheet", "paper", "scale", "files")
    for name in sheets:
        drawing = draw(model, name)
        files = write_drawing(drawing, out)
        table.add_row(
            name, NAMES[drawing.paper], drawing.scale.text, ", ".join(str(file.name) for file in files)
        )
    console.print(table)
    console.print(f"in {out}")


def write_drawing(drawing: Drawing, folder: Path) -> list[Path]:
    """Write the three files of a sheet. Raises UserError if they cannot be written."""
    document = dxf_document(drawing)
    files = {
        folder / f"{drawing.name}.dxf": dxf_bytes(document),
        folder / f"{drawing.name}.png": picture(document, drawing, "png"),
        folder / f"{drawing.name}.pdf": picture(document, drawing, "pdf"),
    }
    for path, data in files.items():
        write_atomic(path, data)
    return list(files)

"""`chefbot robot export solids`: solids for 3-D printers, viewers and CAD, bill of materials, picture."""

from __future__ import annotations

import io
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.table import Table

from chefbot.design.solids.bill_of_materials import ALL, ASSEMBLY, Item, bill, bill_csv
from chefbot.errors import UserError, name_hint
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import write_into_folder

Format = Literal["stl", "glb", "obj", "step"]
FOLDERS = ("stl", "obj")
"""Formats with a file for every part; the others contain the complete robot."""
MILLI = 1e-3


def run_model(robot: str, form: Format, part: str, in_mm: bool, out: Path | None) -> None:
    """Write the requested solids and a picture of them; print the bill of materials.

    Raises UserError for an unknown part, a format without its library, or a path that cannot be written.
    """
    machine = load_robot(robot)
    items = bill(machine)
    chosen = _chosen(items, part)
    _check(form, part, in_mm, out)
    target = out or Path("runs") / (f"{machine.name}_{form}" if form in FOLDERS else f"{machine.name}.{form}")
    if form in FOLDERS and target.suffix != f".{form}":
        files = _folder(machine, items, chosen, part, form, 1.0 / MILLI if in_mm else 1.0)
        paths = {target / name: data for name, data in files.items()}
    else:
        files = _single(machine, chosen, form, 1.0 / MILLI if in_mm else 1.0, target)
        paths = {target.with_name(name): data for name, data in files.items()}
    for path, data in paths.items():
        _write(path, data)
    _print(machine, items, list(paths))


def _chosen(items: list[Item], part: str) -> Item | None:
    """Return the requested item; None for the assembly, or for all."""
    if part in (ALL, ASSEMBLY):
        return None
    by_name = {item.name: item for item in items}
    parts = {**{item.part.kind: item for item in reversed(items)}, **by_name}
    if part not in parts:
        raise UserError(
            f"the robot has no part {part!r}{name_hint(part, parts)}; it has {', '.join(by_name)}, all and assembly"
        )
    return parts[part]


def _check(form: Format, part: str, in_mm: bool, out: Path | None) -> None:
    if in_mm and form == "glb":
        raise UserError("the GLB format is in metres; --mm is for stl and obj")
    if form == "step" and find_spec("build123d") is None:
        raise UserError("STEP needs a CAD kernel that is not installed: pip install 'chefbot[cad]'")
    if out is None:
        return
    if form not in FOLDERS and out.suffix.lower() != f".{form}":
        raise UserError(f"--out {out} must be a file that ends in .{form}")
    if form in FOLDERS and part == ALL and out.suffix == f".{form}":
        raise UserError(
            f"--out {out} must be a folder, since every part gets a file; select one part with --part"
        )


def _folder(
    robot: Robot, items: list[Item], chosen: Item | None, part: str, form: str, scale: float
) -> dict[str, bytes]:
    """Return file name to content: every item as oriented for printing, assembly, bill of materials, pictures."""
    exported = items if part == ALL else [chosen] if chosen else []
    files: dict[str, bytes] = {}
    for item in exported:
        files |= _part_files(item, form, scale)
    if chosen is None:
        files |= _assembly_files(robot, form, scale, ASSEMBLY)
    return files | {
        "bom.csv": bill_csv(items),
        f"{chosen.name if chosen else ASSEMBLY}.png": _png(robot, chosen),
    }


def _single(robot: Robot, chosen: Item | None, form: str, scale: float, target: Path) -> dict[str, bytes]:
    """Return file name to content: one file, and its picture."""
    picture = {f"{target.stem}.png": _png(robot, chosen)}
    if form == "glb":
        from chefbot.design.solids.glb import glb, part_glb

        return {target.name: part_glb(chosen.part) if chosen else glb(robot)} | picture
    if form == "step":
        return {target.name: _step(robot, chosen)} | picture
    files = _part_files(chosen, form, scale) if chosen else _assembly_files(robot, form, scale, target.stem)
    (first, *others) = files.values()
    return {target.name: first} | dict(zip(list(files)[1:], others, strict=True)) | picture


def _part_files(item: Item, form: str, scale: float) -> dict[str, bytes]:
    from chefbot.design.solids.stl_obj import in_print_position, obj, stl

    piece = in_print_position(item.part)._replace(name=item.name)
    if form == "stl":
        return {f"{item.name}.stl": stl(piece.mesh, scale)}
    library = f"{item.name}.mtl"
    text, looks = obj([piece], library, scale)
    return {f"{item.name}.obj": text, library: looks}


def _assembly_files(robot: Robot, form: str, scale: float, stem: str) -> dict[str, bytes]:
    from chefbot.design.solids.stl_obj import obj, pieces, stl, united_robot

    if form == "stl":
        return {f"{stem}.stl": stl(united_robot(robot), scale)}
    text, looks = obj(pieces(robot), f"{stem}.mtl", scale)
    return {f"{stem}.obj": text, f"{stem}.mtl": looks}


def _step(robot: Robot, chosen: Item | None) -> bytes:
    """Return the STEP file, via a temporary file: the CAD kernel writes only files."""
    from build123d import export_step

    from chefbot.design.solids.step import cad_assembly, cad_part

    shape = cad_part(chosen.part) if chosen else cad_assembly(robot)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.step"
        if not export_step(shape, path):
            raise UserError(f"the CAD kernel could not write a STEP file into {folder}; is there space?")
        return path.read_bytes()


def _png(robot: Robot, chosen: Item | None) -> bytes:
    from PIL import Image

    from chefbot.design.solids.renderer import RenderedBody, picture
    from chefbot.design.solids.stl_obj import in_print_position, pieces

    shown = [in_print_position(chosen.part)] if chosen else pieces(robot)
    file = io.BytesIO()
    Image.fromarray(picture([RenderedBody(piece.mesh, piece.colour) for piece in shown])).save(file, "PNG")
    return file.getvalue()


def _write(path: Path, data: bytes) -> None:
    """Write a file; refuse a path that exists and is not a file, such as a device."""
    try:
        is_other = path.exists() and not path.is_file()
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    if is_other:
        raise UserError(f"{path} cannot be written: it exists and is not a file")
    write_into_folder(path, data)


def _print(robot: Robot, items: list[Item], paths: list[Path]) -> None:
    console = Console(highlight=False)
    table = Table(title=f"Bill of materials: {robot.name}", title_justify="left", box=None, pad_edge=False)
    for name in ("part", "description"):
        table.add_column(name)
    for name in ("count", "kg each", "kg", "box, mm"):
        table.add_column(name, justify="right", no_wrap=True)
    for item in items:
        size = " x ".join(f"{round(side / MILLI, 1):g}" for side in item.size)
        what = item.title or item.part.material
        table.add_row(item.name, what, str(item.number), f"{item.part.mass:.4f}", f"{item.mass:.4f}", size)
    table.add_section()
    table.add_row("all", "", str(sum(item.number for item in items)), "", f"{unloaded_mass(robot):.4f}", "")
    console.print(table)
    folder = paths[0].parent
    console.print(f"\nWritten to {folder}: {', '.join(path.name for path in paths)}", soft_wrap=True)

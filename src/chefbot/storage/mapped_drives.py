"""What a map bundle holds of the drives that its map was built from, and of the mapper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from chefbot.errors import ScanError, UserError
from chefbot.mapping.map_format import encode_map_yaml, encode_pgm
from chefbot.maths.grid import Grid
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.params import GmappingParams
from chefbot.slam.session import Session
from chefbot.storage.map_bundle import BUNDLE_SUFFIX, encode_bundle, read_bundle
from chefbot.storage.map_files import map_png

BUNDLE = f"map{BUNDLE_SUFFIX}"
MAPPER, SESSION = "mapper.json", "session_{:03d}.npz"
MapperParams = GmappingParams | GraphSlamParams


class Mapper(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The algorithm of a map, and its parameters as JSON."""

    algorithm: str
    params: msgspec.Raw


class MappedDrives(NamedTuple):
    """The drives of a map, and the parameters of the mapper that has built it."""

    params: MapperParams
    sessions: list[Session]


def bundle_path(path: Path) -> Path:
    """Return the bundle at a path, which may be the folder that it is in."""
    return path / BUNDLE if path.is_dir() else path


def encode_drives(params: MapperParams, sessions: Sequence[Session], others: dict[str, bytes]) -> bytes:
    """Return a bundle of drives and other files, such as the map's."""
    drives = {SESSION.format(i): session.to_bytes() for i, session in enumerate(sessions)}
    return encode_bundle({MAPPER: encode_mapper(params), **drives, **others})


def files_beside_map(params: MapperParams, sessions: Sequence[Session], grid: Grid) -> dict[str, bytes]:
    """Return what belongs beside a map: its picture, and a bundle of it with its drives."""
    image = encode_pgm(grid)
    files = {"map.pgm": image, "map.yaml": encode_map_yaml("map.pgm", grid, image=image)}
    return {"map.png": map_png(grid), BUNDLE: encode_drives(params, sessions, files)}


def encode_mapper(params: MapperParams) -> bytes:
    """Return the algorithm that these parameters are of, and the parameters, as JSON."""
    return msgspec.json.encode(Mapper(algorithm_of(params), msgspec.Raw(msgspec.json.encode(params))))


def algorithm_of(params: MapperParams) -> str:
    """Return the name of the algorithm that these parameters are of."""
    return "gmapping" if isinstance(params, GmappingParams) else "graph"


def decode_mapper(data: bytes) -> MapperParams:
    """Return the parameters of such JSON. Raises ScanError for any other content."""
    try:
        mapper = msgspec.json.decode(data, type=Mapper)
        kind: type[MapperParams] = GmappingParams if mapper.algorithm == "gmapping" else GraphSlamParams
        return msgspec.json.decode(mapper.params, type=kind)
    except (msgspec.MsgspecError, ValueError) as error:  # also bytes that are not text
        raise ScanError(f"{MAPPER}: {error}") from None


def load_drives(path: Path) -> MappedDrives:
    """Return the drives of a bundle, or of the folder that it is in. Raises UserError if they cannot be read."""
    path = bundle_path(path)
    files = read_bundle(path)
    try:
        params = decode_mapper(files.get(MAPPER, b""))
        names = sorted(name for name in files if name.startswith("session_"))
        sessions = [Session.from_bytes(files[name]) for name in names]
    except ScanError as error:
        raise UserError(f"{path}: {error}") from None
    if not sessions:
        raise UserError(f"{path} has no drive to continue from")
    return MappedDrives(params, sessions)

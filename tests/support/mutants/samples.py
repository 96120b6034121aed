"""A valid sample of every kind of file that strangers give, how it is mutated, and how it is read."""

from __future__ import annotations

import gzip
import io
import json
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from random import Random
from typing import NamedTuple

import msgspec
import numpy as np

from chefbot.fleet.certificates import ecdsa_sign, read_key
from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership import Card
from chefbot.maths.grid import Grid
from chefbot.storage.map_bundle import MANIFEST, encode_bundle
from chefbot.storage.map_files import map_png
from chefbot.storage.mapped_drives import MAPPER
from tests.support.mutants import readers, texts
from tests.support.mutants.mutations import (
    Mutation,
    any_bytes,
    changed_tree,
    encoded,
    gzipped,
    json_tree,
    mcap_records,
    pem,
    pgm_header,
    png_chunks,
    tokens,
    xml_tree,
    yaml_tree,
)

PLAIN = (any_bytes, any_bytes, encoded)
YAML = (*PLAIN, tokens, tokens, yaml_tree, yaml_tree, yaml_tree)
XML = (*PLAIN, tokens, tokens, tokens, xml_tree, xml_tree, xml_tree)
OBSTACLES = ("folder", "pipe", "device", "circular link", "missing", "unreadable link")
"""What may be in the place of a file."""
NOW = datetime(2026, 11, 21, tzinfo=UTC)


class Sample(NamedTuple):
    """Valid files below a folder, the mutations of those that are changed, and the function that reads them."""

    files: Mapping[str, bytes]
    mutations: Mapping[str, Sequence[Mutation]]
    read: Callable[[Path], object]

    def mutant(self, rng: Random) -> dict[str, bytes | str]:
        """The files with one of them changed; a text is the obstacle that is there instead of a file."""
        name = rng.choice(sorted(self.mutations))
        if rng.random() < 0.02:
            return {**self.files, name: rng.choice(OBSTACLES)}
        return {**self.files, name: rng.choice(self.mutations[name])(self.files[name], rng)}


def write(folder: Path, files: Mapping[str, bytes | str]) -> None:
    """Write a mutant below a new folder."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(data, bytes):
            path.write_bytes(data)
            path.chmod(0o600)  # as private keys must be
        else:
            _put_obstacle(path, data)


def _put_obstacle(path: Path, kind: str) -> None:
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind != "missing":
        path.symlink_to({"device": "/dev/zero", "circular link": path.name}.get(kind, "/root/none/x"))


def _keys() -> tuple[dict[str, bytes], bytes]:
    """The key folder of an authority after it admitted a robot, and the robot's card."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        office, robot, other = (Keyring(Path(folder, name)) for name in ("office", "robot", "other"))
        office.create_fleet("hotel", NOW)
        card, _ = office.admit(robot.request_membership("robot1"), NOW, "robot")
        other.request_membership("robot2")
        files = {
            f"{place}/{path.name}": path.read_bytes()
            for place, ring in (("keys", office), ("robot", robot), ("other", other))
            for path in sorted(ring.folder.iterdir())
        }
        return files, msgspec.json.encode(card)


def _signed_again(key: bytes) -> Mutation:
    """The list of members is changed and signed by the authority itself; or a field of the card is."""

    def mutation(data: bytes, rng: Random) -> bytes:
        card = msgspec.json.decode(data, type=Card)
        kind = rng.randrange(3)
        if kind == 0:
            members = json.dumps(changed_tree(json.loads(card.fleet), rng)).encode()
            members = any_bytes(members, rng) if rng.random() < 0.3 else members
            card = msgspec.structs.replace(
                card, fleet=members, signature=ecdsa_sign(members, read_key(key, "key"))
            )
        elif kind == 1:
            field = rng.choice(("authority", "certificate"))
            card = msgspec.structs.replace(card, **{field: pem(getattr(card, field), rng)})
        else:
            field = rng.choice(("authority", "fleet", "signature", "certificate"))
            card = msgspec.structs.replace(card, **{field: any_bytes(getattr(card, field), rng)})
        return msgspec.json.encode(card)

    return mutation


def _grid() -> Grid:
    cells = np.full((24, 30), 0, np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 100, 100, 100, 100
    cells[10:12, 10:14] = -1
    return Grid(cells, 0.05, -0.5, -0.5)


@cache
def samples() -> dict[str, Sample]:
    """The samples by name of their kind."""
    grid = _grid()
    keys, card = _keys()
    log, bag = readers.recorded()
    carmen = texts.CARMEN.encode()
    return {
        "map_pgm": _map("map.pgm", readers.pgm(grid), (any_bytes, pgm_header, encoded)),
        "map_png": _map("map.png", map_png(grid), (any_bytes, png_chunks, png_chunks, png_chunks)),
        "bundle": _one(
            "map.bundle",
            readers.bundle(grid),
            (
                any_bytes,
                encoded,
                *(3 * (_in_bundle(any_bytes),)),
                _in_bundle(json_tree, MAPPER),
                _in_bundle(yaml_tree, "map.yaml"),
            ),
            readers.drives,
        ),
        "world": _one("w.yaml", texts.WORLD, YAML, readers.world),
        "robot": _one("r.yaml", texts.ROBOT, YAML, readers.robot),
        "calibration": _one("r.yaml", texts.CALIBRATED, YAML, readers.calibrated),
        "launch": _one("l.yaml", texts.LAUNCH, YAML, readers.launch),
        "parameters": _one("l.yaml", texts.PARAMETERS, YAML, readers.parameters),
        "scenario": _one("s.yaml", texts.SCENARIO, YAML, readers.scenario),
        "places": _one("m.places.yaml", texts.PLACES, YAML, readers.places),
        "urdf": _one("r.urdf", readers.urdf_text(), XML, readers.urdf),
        "xacro": _xacro(),
        "carmen": Sample(
            {"a.log": carmen, "b.log.gz": gzip.compress(carmen, mtime=0)},
            {"a.log": (*PLAIN, tokens, tokens), "b.log.gz": (*PLAIN, gzipped(tokens), gzipped(any_bytes))},
            readers.carmen,
        ),
        "relations": _one("x.relations", texts.RELATIONS, (*PLAIN, tokens, tokens), readers.relations),
        "log": Sample({"run.mcap": log}, {"run.mcap": (any_bytes, mcap_records, mcap_records)}, readers.log),
        "bag": Sample(
            {f"bag/{name}": data for name, data in bag.items()},
            {
                "bag/bag_0.mcap": (any_bytes, mcap_records, mcap_records),
                "bag/metadata.yaml": YAML,
            },
            readers.bag,
        ),
        "card": Sample(
            {**keys, "robot1.card": card},
            {"robot1.card": (*PLAIN, json_tree, *(3 * (_signed_again(keys["keys/authority.key"]),)))},
            readers.card,
        ),
        "keys": Sample(
            keys,
            {
                name: (*PLAIN, json_tree) if name.endswith("json") else (*PLAIN, pem, pem, pem)
                for name in keys
                if not name.endswith("site.request")
            },
            readers.keys,
        ),
    }


def _in_bundle(mutation: Mutation, member: str = "") -> Mutation:
    """A mutation of a file in a map bundle, of any without a name; the checksums are right again."""

    def mutated(data: bytes, rng: Random) -> bytes:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = {name: archive.read(name) for name in archive.namelist() if name != MANIFEST}
        name = member or rng.choice(sorted(files))
        return encode_bundle({**files, name: mutation(files[name], rng)})

    return mutated


def _one(
    name: str, text: str | bytes, mutations: Sequence[Mutation], read: Callable[[Path], object]
) -> Sample:
    data = text.encode() if isinstance(text, str) else text
    return Sample({name: data}, {name: mutations}, lambda folder: read(folder / name))


def _map(image: str, data: bytes, mutations: Sequence[Mutation]) -> Sample:
    about = texts.MAP.format(image=image).encode()
    return Sample({"map.yaml": about, image: data}, {"map.yaml": YAML, image: mutations}, readers.map_of)


def _xacro() -> Sample:
    files = {name: text.encode() for name, text in texts.XACRO.items()}
    changed = {name: YAML if name.endswith("yaml") else XML for name in files if name != "package.xml"}
    return Sample(files, changed, readers.xacro_file)

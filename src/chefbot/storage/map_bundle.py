"""Map bundles: one file with a map, its places and zones, and the drives that it was built from.

A bundle is a ZIP archive with a `manifest.json` that has the version and the SHA-256 of each other file. The same
content gives the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

import msgspec

from chefbot.config import read_bytes
from chefbot.errors import ChefbotError

VERSION, BUNDLE_SUFFIX = 1, ".bundle"
MANIFEST = "manifest.json"
MAX_FILES, MAX_BYTES = 1000, 2_000_000_000
"""Maximum number of files, and of their bytes in total, before and after decompression."""
EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time of all files, the earliest that the format has."""


class MapBundleError(ChefbotError):
    """A map bundle that is damaged, or of a later version."""


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a bundle holds: the version of its form, and the SHA-256 of each file by its name."""

    version: int
    files: dict[str, str]


def encode_bundle(files: Mapping[str, bytes]) -> bytes:
    """Return the bytes of a bundle with these files by name."""
    manifest = Manifest(
        VERSION, {name: hashlib.sha256(data).hexdigest() for name, data in sorted(files.items())}
    )
    archive_bytes = io.BytesIO()
    with zipfile.ZipFile(archive_bytes, "w") as archive:
        for name, data in [(MANIFEST, msgspec.json.encode(manifest)), *sorted(files.items())]:
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return archive_bytes.getvalue()


def read_bundle(path: Path) -> dict[str, bytes]:
    """Return the files of a bundle by name.

    Raises ConfigError if it cannot be read, MapBundleError if it is damaged or of a later version.

    Nothing is written, so that no name in it can reach another folder.
    """
    return decode_bundle(read_bytes(path, "map bundle", MAX_BYTES), path)


def decode_bundle(data: bytes, path: Path) -> dict[str, bytes]:
    """Return the files in a bundle's bytes by name. path: names it in errors. MapBundleError as for `read_bundle`."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _checked(path, archive)
    except MapBundleError:
        raise
    except Exception:  # whatever zipfile and zlib raise for damaged bytes
        hint = f"; the bundle beside a map is map{BUNDLE_SUFFIX}" if path.suffix != BUNDLE_SUFFIX else ""
        raise MapBundleError(f"{path} is not a map bundle, or it is damaged{hint}") from None


def _checked(path: Path, archive: zipfile.ZipFile) -> dict[str, bytes]:
    entries = {entry.filename: entry for entry in archive.infolist()}
    total = sum(entry.file_size for entry in entries.values())
    if len(archive.infolist()) > MAX_FILES or total > MAX_BYTES:
        raise MapBundleError(
            f"{path} has {len(archive.infolist())} files of {total} bytes, too many for a map bundle"
        )
    if MANIFEST not in entries:
        raise MapBundleError(f"{path} is not a map bundle: it has no {MANIFEST}")
    manifest = _manifest(path, archive.read(MANIFEST))
    if set(entries) != {MANIFEST, *manifest.files}:
        raise MapBundleError(f"{path} is damaged: its files are not those of its {MANIFEST}")
    files = {name: archive.read(name) for name in manifest.files}
    for name, data in files.items():
        if hashlib.sha256(data).hexdigest() != manifest.files[name]:
            raise MapBundleError(f"{path} is damaged: {name} has been changed")
    return files


def _manifest(path: Path, data: bytes) -> Manifest:
    try:
        version = msgspec.json.decode(data, type=dict[str, object]).get("version")
        if version != VERSION:
            raise MapBundleError(
                f"{path} has version {version} of map bundles, this chefbot reads {VERSION}; update it"
            )
        return msgspec.json.decode(data, type=Manifest)
    except (msgspec.MsgspecError, ValueError) as error:  # also bytes that are not text
        raise MapBundleError(f"{path} is damaged: {MANIFEST}: {error}") from None

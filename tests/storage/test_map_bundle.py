"""Map bundles: the same bytes for the same content, and a sentence for each that is damaged."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chefbot.config import ConfigError
from chefbot.storage import map_bundle
from chefbot.storage.map_bundle import MapBundleError, encode_bundle, read_bundle

FILES = {"map.yaml": b"resolution: 0.05\n", "session_000.npz": bytes(range(256)) * 4}


def test_a_bundle_is_read_as_written(tmp_path: Path) -> None:
    (tmp_path / "map.bundle").write_bytes(encode_bundle(FILES))
    assert read_bundle(tmp_path / "map.bundle") == FILES
    assert encode_bundle(FILES) == encode_bundle(dict(reversed(FILES.items())))


def archive(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as one:
        for name, data in files.items():
            one.writestr(name, data)
    return file.getvalue()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not a map bundle"),
        (b"image: map.pgm\n", "not a map bundle"),
        (archive({"map.yaml": b""}), "no manifest.json"),
        (archive({"manifest.json": b'{"version": 2, "files": {}}'}), "version 2 .* this chefbot reads 1"),
        (archive({"manifest.json": b"[1]"}), "damaged"),
        (archive({"manifest.json": b'{"version": 1, "files": {"a": "0"}}'}), "its files are not those"),
        (archive({"manifest.json": b'{"version": 1, "files": {"a": "0"}}', "a": b"x"}), "a has been changed"),
        (
            archive({"manifest.json": b'{"version": 1, "files": {}}', "../../evil": b"x"}),
            "its files are not those",
        ),
    ],
)
def test_what_is_not_a_bundle_is_reported_in_one_sentence(tmp_path: Path, data: bytes, reason: str) -> None:
    path = tmp_path / "map.bundle"
    path.write_bytes(data)
    with pytest.raises(MapBundleError, match=reason):
        read_bundle(path)
    assert [one.name for one in tmp_path.iterdir()] == ["map.bundle"]


def test_a_missing_bundle_and_a_folder_are_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none", tmp_path):
        with pytest.raises(ConfigError, match=str(path)):
            read_bundle(path)


def test_a_bundle_that_would_fill_the_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(map_bundle, "MAX_BYTES", 1_000_000)
    (tmp_path / "map.bundle").write_bytes(encode_bundle({"zeros": bytes(2_000_000)}))
    assert (tmp_path / "map.bundle").stat().st_size < 10_000
    with pytest.raises(MapBundleError, match="too many"):
        read_bundle(tmp_path / "map.bundle")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 10_000), value=st.integers(0, 255), cut=st.booleans())
def test_no_change_of_a_byte_gives_other_content(tmp_path: Path, place: int, value: int, cut: bool) -> None:
    data = bytearray(encode_bundle(FILES))
    at = place % len(data)
    if cut:
        data = data[:at]
    else:
        data[at] = value
    path = tmp_path / "map.bundle"
    path.write_bytes(data)
    try:
        assert read_bundle(path) == FILES
    except MapBundleError as error:
        assert str(path) in str(error)

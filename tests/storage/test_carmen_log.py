"""The text of a log, gzip-compressed or not, and one sentence for what is not a log."""

from __future__ import annotations

import gzip
import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.errors import ChefbotError, UserError
from chefbot.storage import carmen_log
from chefbot.storage.carmen_log import read_text

LINE = "ODOM 0 0 0 0 0 0 1.0 host 1.0\n"


@given(st.text(st.characters(codec="ascii"), max_size=200), st.booleans())
def test_the_text_is_that_of_the_file(
    tmp_path_factory: pytest.TempPathFactory, text: str, compressed: bool
) -> None:
    path = tmp_path_factory.mktemp("logs") / "a.log"
    path.write_bytes(gzip.compress(text.encode(), mtime=0) if compressed else text.encode())
    assert read_text(path) == (text, "")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (gzip.compress(LINE.encode(), mtime=0)[:12] + b"\xff" * 40, "is a damaged gzip file"),
        (gzip.compress(b"\xff\xfe", mtime=0), "is not a CARMEN log: it is not text"),
        ("Küche".encode(), "is not a CARMEN log: it is not text"),
    ],
)
def test_what_is_not_a_log_is_reported_in_one_sentence(tmp_path: Path, data: bytes, sentence: str) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(data)
    with pytest.raises(UserError, match=sentence) as caught:
        read_text(path)
    assert str(caught.value).startswith(f"log {path} ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", [2, 9, 200])
def test_of_a_cut_file_what_it_has_is_used(tmp_path: Path, missing: int) -> None:
    text = "".join(LINE.replace("1.0", f"{random.Random(i).random()}") for i in range(99))
    path = tmp_path / "a.log"
    path.write_bytes(gzip.compress(text.encode(), mtime=0)[:-missing])
    found = read_text(path)
    assert text.startswith(found.text) and len(found.text) >= len(text) // 2
    assert found.note == "The gzip file is cut off; what it has is used."


def test_a_missing_log_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match=r"absent\.log does not exist"):
        read_text(tmp_path / "absent.log")


def test_a_small_file_cannot_unpack_to_an_enormous_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(carmen_log, "MAX_LOG_BYTES", 10_000)
    path = tmp_path / "a.log"
    path.write_bytes(gzip.compress(b" " * 10_000))
    assert len(read_text(path).text) == 10_000
    path.write_bytes(gzip.compress(b" " * 10_001))
    with pytest.raises(UserError, match="unpacks to more than 10000 bytes"):
        read_text(path)

"""Hypothesis draws the same examples in every run of the tests, in any order of them."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


def examples() -> list[float]:
    drawn: list[float] = []

    @settings(max_examples=200, database=None)
    @given(st.lists(st.floats(-1e6, 1e6), max_size=5))
    def draw(values: list[float]) -> None:
        drawn.extend(values)

    draw()
    return drawn


@pytest.mark.skipif(os.environ.get("HYPOTHESIS_PROFILE") == "search", reason="searches by chance")
@pytest.mark.slow
def test_examples_do_not_depend_on_loaded_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = examples()
    name = "constants_of_other_code"
    file = tmp_path / f"{name}.py"
    file.write_text("".join(f"C{n} = {n * 1.37 + 1000.5}\n" for n in range(200)))
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    assert examples() == before

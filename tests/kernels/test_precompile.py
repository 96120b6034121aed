"""Tests that all kernels are compiled ahead of time, once and with progress, and that failures are reported."""

from __future__ import annotations

import os
from pathlib import Path

import numba
import pytest
from rich.console import Console

from chefbot.kernels import cache_stamp, precompile
from chefbot.kernels.groups import FIRST_PICTURE_GROUPS, GROUPS, kernel_files
from chefbot.kernels.precompile import (
    KernelCompilation,
    compile_kernels_of,
    record_stamp,
    start_compilation,
)


@pytest.mark.slow
def test_a_worker_compiles_a_group_and_records_its_kernel_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compilation = KernelCompilation(Console(quiet=True), ["odometry"])
    compilation.start()
    progress_reports: list[tuple[int, int]] = []
    compilation.wait(show=lambda progress: progress_reports.append((progress.done, progress.total)))
    assert progress_reports[-1] == (1, 1) and not compilation.busy
    assert cache_stamp.is_complete(cache_stamp.stamp_path())
    assert "fusion.propagate" in cache_stamp.stamp_path().read_text()


def test_a_stamp_skips_compilation_while_its_files_exist(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kernel_file = tmp_path / "kernel.nbi"
    kernel_file.touch()
    record_stamp(Console(quiet=True), {str(kernel_file)}, cache_stamp.stamp_path())
    assert not start_compilation(Console(quiet=True)).busy
    kernel_file.unlink()
    assert not cache_stamp.is_complete(cache_stamp.stamp_path())


def test_a_truncated_stamp_is_invalid(tmp_path: Path) -> None:
    stamp = tmp_path / "stamp"
    for content in ("", '["/a', "[]", "{}"):
        stamp.write_text(content)
        assert not cache_stamp.is_complete(stamp)


def test_the_stamp_depends_on_the_numba_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = cache_stamp.stamp_path()
    assert cache_stamp.stamp_path() == plain
    monkeypatch.setenv("NUMBA_OPT", "1" if os.environ.get("NUMBA_OPT") != "1" else "2")
    assert cache_stamp.stamp_path() != plain


def test_a_failing_worker_is_reported_and_does_not_block_startup() -> None:
    console = Console(record=True, quiet=False, file=open(os.devnull, "w"))  # noqa: SIM115, PTH123
    compilation = KernelCompilation(console, ["no such group"])
    compilation.start()
    compilation.wait()
    assert not compilation.busy
    assert "no such group" in console.export_text()


def test_an_unwritable_cache_folder_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert not cache_stamp.is_complete(cache_stamp.stamp_path())
    console = Console(record=True, file=open(os.devnull, "w"))  # noqa: SIM115, PTH123
    record_stamp(console, {"a"}, cache_stamp.stamp_path())
    assert "Cannot record" in console.export_text()


def test_groups_of_the_first_picture_exist() -> None:
    assert set(FIRST_PICTURE_GROUPS) <= set(GROUPS)
    assert tuple(GROUPS)[: len(FIRST_PICTURE_GROUPS)] == FIRST_PICTURE_GROUPS


def test_kernel_files_belong_to_compiled_kernels() -> None:
    GROUPS["odometry"]()
    if numba.config.DISABLE_JIT:
        pytest.skip("kernels are not compiled at all")
    files = kernel_files()
    assert files and all(Path(file).exists() for file in files)


@pytest.mark.parametrize(
    ("kinds", "demo_is_compiled", "expected"),
    [
        (["chefbot.devices.keyboard:KeyboardDevice"], False, []),
        (["chefbot.nodes.amcl:AmclNode"], False, ["localization"]),
        (["chefbot.nodes.amcl:AmclNode"], True, []),
        (["chefbot.nodes.graph_slam:GraphSlamNode"], True, ["graph_mapping"]),
    ],
)
def test_a_joined_launch_compiles_its_own_kernels_only(
    kinds: list[str],
    demo_is_compiled: bool,
    expected: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    if demo_is_compiled:
        (tmp_path / "kernel.nbi").touch()
        record_stamp(Console(quiet=True), {str(tmp_path / "kernel.nbi")}, cache_stamp.stamp_path())
    compiled: list[str] = []

    class Recorded(KernelCompilation):
        def start(self) -> None:
            compiled.extend(self._groups)

    monkeypatch.setattr(precompile, "KernelCompilation", Recorded)
    compile_kernels_of(Console(quiet=True), kinds)
    assert compiled == expected

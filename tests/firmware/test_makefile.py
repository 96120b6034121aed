"""Runs the checks of the firmware's Makefile: unit tests under sanitizers, coverage, fuzzing and program size.

Mutation tests take minutes and are left to `make -C firmware test`.
"""

from __future__ import annotations

import re

import pytest

from tests.firmware.host_board import make, need


@pytest.mark.rotated("firmware checks")
def test_unit_tests_pass_under_sanitizers() -> None:
    need("make", "g++")
    assert re.search(r"\d+ tests, 0 failed", make("unit"))


@pytest.mark.rotated("firmware checks")
@pytest.mark.slow
def test_the_library_compiles_without_a_warning() -> None:
    need("make", "g++")
    make("host")


@pytest.mark.rotated("firmware checks")
@pytest.mark.slow
def test_safety_code_is_fully_covered() -> None:
    need("make", "g++", "gcov")
    assert "100.0 % of lines, 100.0 % of branches" in make("coverage")


@pytest.mark.rotated("firmware checks")
@pytest.mark.slow
@pytest.mark.parametrize("millions", [2, pytest.param(10, marks=pytest.mark.long)])
def test_millions_of_fuzzed_bytes_do_no_harm(millions: int) -> None:
    need("make", "g++")
    output = make("fuzz", BYTES=millions * 10**6, SEED=2)
    match = re.search(r"fuzz: (\d+) bytes.* (\d+) lines accepted.* motion in (\d+) of", output)
    assert match and int(match[1]) >= millions * 10**6
    assert int(match[2]) > 100 * millions and int(match[3]) > 100 * millions


def test_the_program_fits_the_avr() -> None:
    need("make", "avr-g++")
    match = re.search(r"core.*: (\d+) bytes", make("avr"))
    assert match and int(match[1]) <= 8192

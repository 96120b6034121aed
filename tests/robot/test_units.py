"""Quantities as people write them."""

import contextlib
import math

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.units import DEFINITIONS, UnitError, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("9 cm", "m", 0.09),
        ("9cm", "m", 0.09),
        ("80 rpm", "rad/s", 80 * 2 * math.pi / 60),
        ("10 kg cm", "N m", 0.980665),
        ("10 kgf cm", "N m", 0.980665),
        ("0.98 N m", "N m", 0.98),
        ("0.98 N*m", "N m", 0.98),
        ("10 Ah", "C", 36_000.0),
        ("10 A h", "C", 36_000.0),
        ("2 h", "s", 7200.0),
        ("60 g", "kg", 0.06),
        ("0.35 m/s", "m/s", 0.35),
        ("0.5 m/s^2", "m/s^2", 0.5),
        ("0.05 deg/s", "rad/s", math.radians(0.05)),
        ("30 deg", "rad", math.pi / 6),
        ("30 degrees", "rad", math.pi / 6),
        ("50 Hz", "Hz", 50.0),
        ("12 V", "V", 12.0),
        ("25 W", "W", 25.0),
        ("12.5 watt", "W", 12.5),
        ("1.5e3 mAh", "C", 5400.0),
        (".5 m / s", "m/s", 0.5),
        ("2 rad/s**2", "rad/s^2", 2.0),
        ("-3 mm", "m", -0.003),
        ("90°", "rad", math.pi / 2),
        ("2 Ω", "ohm", 2.0),
        ("2 \u2126", "ohm", 2.0),
    ],
)
def test_common_spellings_of_quantities_parse(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


def defined_names():
    """The names of all units of our definitions."""
    for line in DEFINITIONS.read_text().splitlines():
        name, *rest = line.partition("#")[0].split(" = ")
        if rest and not name.endswith("-"):
            yield from (name, *rest[1:])


def test_every_unit_equals_that_of_pint():
    own, theirs = pint.UnitRegistry(DEFINITIONS), pint.UnitRegistry()
    names = set(defined_names()) - {"rev"}  # pint knows the revolution as `turn` only
    assert len(names) > 80
    for name in names:
        expected = theirs.Quantity(1.0, name).to_base_units()
        found = own.Quantity(1.0, name).to(str(expected.units)).magnitude
        assert found == pytest.approx(expected.magnitude, rel=1e-12), name


def test_no_unit_is_defined_twice(caplog):
    pint.UnitRegistry(DEFINITIONS)
    assert [record.getMessage() for record in caplog.records] == []


@pytest.mark.parametrize(
    "text", ["9", "", " ", "cm", "9 kg", "9 parsnips", "nine cm", "9 cm cm", "1/0 m", "()"]
)
def test_invalid_lengths_are_refused(text):
    with pytest.raises(UnitError):
        to_si(text, "m")


@settings(max_examples=300)
@given(st.text("0123456789.e+-*/()^% kmcsradegHzVWACN\x00'\"_[]{}:,\n", max_size=14))
def test_any_text_gives_a_number_or_one_sentence(text):
    with contextlib.suppress(UnitError):
        assert isinstance(to_si(text, "m"), float)


@pytest.mark.parametrize(
    "text", ["9**9**9**9 m", "9^9^9^9 m", "(" * 5000 + "1 m", "1e999999999 m", "9" * 100_000 + " m"]
)
def test_absurd_quantities_are_refused(text):
    with pytest.raises(UnitError):
        if math.isinf(to_si(text, "m")):
            raise UnitError("infinite, which the bounds of every field refuse")

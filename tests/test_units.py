"""Tests of quantities, which consist of a number and a unit.

The results are the same with and without pint, and all other texts are rejected.
"""

import math
import re
import sys
from fractions import Fraction
from unittest import mock

import pint
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from rsfstudy import Rig, read_protocol
from rsfstudy.errors import InvalidValue
from rsfstudy.rig.units import (
    _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT,
    compute_conversion_factor,
    convert_to_si,
)

RIG = Rig(normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s")


@pytest.mark.parametrize(
    ("text", "units", "value"),
    [
        ("5 MPa", "Pa", 5e6),
        ("12 bar", "Pa", 1.2e6),
        ("10 \u00b5m", "m", 1e-5),
        ("1 um s-1", "m/s", 1e-6),
        ("35 mm/year", "m/s", 35e-3 / (365.25 * 86400.0)),
        ("0.05 MPa/um", "Pa/m", 5e10),
        ("0.1 1/s", "1/s", 0.1),
        ("2700 kg*m**-3", "kg/m^3", 2700.0),
        ("2 kN/mm^2", "Pa", 2e9),
        ("3", "1", 3.0),
        (7.5, "Pa", 7.5),
    ],
)
def test_usual_units(text, units, value):
    assert convert_to_si("x", text, units) == pytest.approx(value, rel=1e-15)


def test_other_units_need_pint(monkeypatch):
    monkeypatch.setitem(sys.modules, "pint", None)
    with pytest.raises(
        InvalidValue, match=r"the library pint. Install pint .*units.*or pass a number"
    ):
        convert_to_si("normal_stress", "725 psi", "Pa")


def test_quantities_of_pint():
    registry = pint.get_application_registry()
    assert convert_to_si("x", "725 psi", "Pa") == pytest.approx(725 * 6894.757293168361, rel=1e-12)
    assert convert_to_si("x", registry.Quantity(3.0, "MPa/um"), "Pa/m") == pytest.approx(3e12)
    assert convert_to_si("x", "1 furlong/fortnight", "m/s") == pytest.approx(1.663e-4, rel=1e-3)
    with pytest.raises(InvalidValue, match="incompatible with m"):
        convert_to_si("x", registry.Quantity(3.0, "MPa"), "m")
    with pytest.raises(InvalidValue, match="unknown to the library pint.*Write, for example,"):
        convert_to_si("x", "3 bananas", "m")


#: Units of stress that rsfstudy supports, and units that need pint.
STRESSES = ("Pa", "kPa", "MPa", "bar", "kg/m/s^2", "kg*m**-1*s-2", "MPa m/mm", "MPa s / s")
OF_PINT = ("psi", "inHg", "lbf/m^2", "percent MPa", "mPa", "psi um/um")
#: Texts that earlier versions read incorrectly, or that caused exceptions or endless loops.
WRONG = (
    "2,5 MPa", "2 5 MPa", "25 MPa 3", "2 MPa!", "2*3 MPa", "1 kPa^999", "5 9**9**9**9",
    "5 MPa^(9**9**9)", "5 MPa**9**9", "1_000 Pa", "0x1F Pa", "0b1 Pa", "0xF Pa", "\u0665 Pa",
    "\uff15 MPa", "\u22125 MPa", "5 MPa^1.0", "5 + 3 MPa", "--5 MPa", "5 MPa/", "5 //Pa", "5 * Pa",
    "5 MPa/m s m/s", "5 1 MPa", "3 1", "5", "", "MPa", "nan MPa", "-inf Pa", "1e999 Pa",
    "1 MPa +/- 1 MPa", "(5+/-1) MPa", "5 dB MPa", "1.5.2 Pa", "5 nan Pa", "5 Pa; 3",
)  # fmt: skip


def read(text):
    """Return the value of a text in Pa, or None if it is rejected."""
    try:
        return convert_to_si("x", text, "Pa")
    except InvalidValue:
        return None


def read_without_pint(text):
    with mock.patch.dict(sys.modules, {"pint": None}):
        return read(text)


@pytest.mark.parametrize("text", WRONG)
def test_what_is_not_one_number_and_one_unit_is_refused(text):
    assert (read(text), read_without_pint(text)) == (None, None)


@pytest.mark.parametrize("name", sorted(_EXACT_FACTOR_AND_EXPONENTS_BY_UNIT))
def test_units_that_both_know_are_the_same(name):
    """The conversion factors agree with pint to rounding error.

    The rounding error of pint is a few times 1.1e-16.
    """
    registry = pint.get_application_registry()
    quantity = registry.Quantity(1.0, registry.parse_units(name)).to_base_units()
    size, exponents = _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT[name]
    assert quantity.magnitude == pytest.approx(size, rel=1e-15)
    dimensions = ("[mass]", "[length]", "[time]", "[temperature]", "[substance]")
    of = zip(dimensions, exponents, strict=True)
    assert dict(quantity.dimensionality) == {n: e for n, e in of if e}


NUMBERS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(["5.", ".5", "+1e3", "1E-3", "007", "-0"]),
)


def product(number, unit):
    """Return a number times the factor of a unit in Pa, rounded once.

    The result is infinity in case of overflow.
    """
    try:
        return float(Fraction(repr(float(number))) * compute_conversion_factor("x", unit, "Pa"))
    except OverflowError:
        return math.inf


@given(NUMBERS, st.sampled_from(["", " ", "  ", "\t", "\u00a0"]), st.sampled_from(STRESSES))
def test_a_number_times_the_factor_of_the_unit(number, between, unit):
    """The result is exact to the last bit, with and without pint."""
    expected = product(number, unit)
    text = f" {number}{between}{unit} "
    wanted = expected if math.isfinite(expected) else None
    assert (read(text), read_without_pint(text)) == (wanted, wanted)


@given(NUMBERS, st.sampled_from(OF_PINT))
def test_of_units_that_pint_alone_knows_too(number, unit):
    expected = product(number, unit)
    text = f"{number} {unit}"
    assert read(text) == (expected if math.isfinite(expected) else None)
    assert read_without_pint(text) is None


#: Nearly valid quantities, and random texts.
ODD = ("**", "1e3", "nan", "inf", "per", "0x", "e-3", "dB", "degC", "s-1", "m", "um")
PIECES = st.sampled_from(
    [*STRESSES, *OF_PINT, *ODD, *"0123456789.,:;_+-*/^!()[]%e xE\t\u00b2\u0665\u22c5\u00b7"]
)
TEXTS = st.one_of(
    st.lists(PIECES, max_size=6).map("".join),
    st.builds("{} {}{}".format, NUMBERS, st.sampled_from(STRESSES + OF_PINT), PIECES),
    st.builds("{}{} {}".format, NUMBERS, PIECES, st.sampled_from(STRESSES + OF_PINT)),
    st.text(max_size=12),
)
#: Numbers in the text of a unit: only a leading number that is divided, and integer powers.
_PLAIN_POWERS = re.compile(r"(?<=[A-Za-z\u00b5\u03bc])(\^|\*\*)?[-+]?[1-9](?![0-9.])")


@settings(max_examples=500, suppress_health_check=[HealthCheck.too_slow])
@given(TEXTS)
@example("5 kg/m/s^2")
@example("5 psi*m/m")
def test_any_text_is_one_number_times_a_factor_or_refused(text):
    found, without = read(text), read_without_pint(text)
    assert without in (None, found)
    if found is None:
        return
    begins = [n for n in range(1, len(text) + 1) if _is_number(text[:n])]
    number, unit = text[: begins[-1]], text[begins[-1] :].strip()
    assert found == product(number, unit)
    rest = _PLAIN_POWERS.sub("", unit.removeprefix("1") if unit[1:].lstrip()[:1] == "/" else unit)
    assert not re.search(r"(?<![A-Za-z])\d|[,;:!_+()\[\]%-]", rest), text


def _is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


# ---- where texts come in -------------------------------------------------------------------------


def test_long_texts_are_read_in_linear_time(tmp_path):
    """Reading takes linear time.

    Cubic time would need 10^14 steps.
    """
    path, blanks = tmp_path / "test.csv", " " * 50_000
    for header in (f"velocity ({blanks}x", f"velocity{blanks}x", f"{blanks}velocity (um/s{blanks}"):
        path.write_text(f"{header}\n1\n")
        with pytest.raises(
            InvalidValue, match="at most 200 char|has 1 fields|does not consist of a name and units"
        ):
            read_protocol(path, RIG)
    for text in (f"5 Pa{blanks}!", "1" * 50_000 + "!", "5 " + "m" * 50_000 + "!"):
        assert read(text) is None

"""Laws of units: spellings that engineers use mean what they mean to engineers, in products as well."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.plant.units import to_si
from slipbench.protocol.units import converts, is_unit, linear, number_and_unit, powers_of, to_base

SPELLINGS = {
    "N m": "Nm N·m N.m N*m",
    "N m/A": "Nm/A N.m/A N·m/A",
    "N m s/rad": "Nms/rad N.m.s/rad Nm/(rad/s)",
    "kg m^2": "kgm^2 kgm2 kgm² kg·m2 kg.m^2",
    "rad/s^2": "rad/s2 rad/s² rad.s-2 rad·s^-2",
    "1/s": "s-1 s^-1",
    "m^3/s": "m3/s m³/s",
    "V/ohm": "V/Ohm V/Ω A Ampere",
    "V s/rad": "Vs/rad",
    "N s/m": "Ns/m",
    "turn/s": "rev/s",
    "count": "LSB ticks cnt",
}
PAIRS = [(own, plain) for plain, some in SPELLINGS.items() for own in some.split()]


@pytest.mark.parametrize(("own", "plain"), PAIRS)
def test_a_spelling_is_the_unit_that_it_stands_for(own, plain):
    slope, zero = linear(own, plain)
    assert slope == pytest.approx(1.0, rel=1e-12)
    assert zero == 0.0
    assert powers_of(own) == powers_of(plain)


def test_a_metric_horsepower_lifts_75_kg_by_1_m_in_1_s():
    assert linear("PS", "W")[0] == pytest.approx(75.0 * 9.80665, rel=1e-12)


@pytest.mark.parametrize("prefixed", ["mNm", "kNm", "kOhm", "mVs", "kW", "MPa", "µm", "mAh"])
def test_a_prefix_multiplies_what_it_stands_before(prefixed):
    factor = {"m": 1e-3, "k": 1e3, "M": 1e6, "µ": 1e-6}[prefixed[0]]
    assert linear(prefixed, prefixed[1:])[0] == pytest.approx(factor, rel=1e-12)


def test_a_logarithmic_unit_converts_to_itself_alone():
    assert is_unit("dB")
    assert not converts("dB", "1")
    with pytest.raises(ValueError, match="logarithmic"):
        to_base("dB")


@pytest.mark.parametrize("text", ["W/m2K", "s--1", "m2s", "9**9**9 m", "kgm/", "sqrt(m)", "2 3"])
def test_what_is_ambiguous_or_no_unit_is_refused(text):
    with pytest.raises(ValueError, match="unit"):
        to_base(text)


def test_vehicle_files_take_newton_metres_as_engineers_write_them():
    assert to_si(3.0, "Nm/rad", "N m/rad") == pytest.approx(3.0)
    assert to_si(3.0, "rad/Nm", "rad/(N m)") == pytest.approx(3.0)


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(["ms", "rpm", "%", "µs", "°C"]),
)
def test_the_space_before_a_unit_may_be_missing(value, unit):
    assert number_and_unit(f"{value!r}{unit}") == (repr(value), unit)
    assert number_and_unit(f" {value!r} {unit} ") == (repr(value), unit)


@pytest.mark.parametrize("text", ["12,5 rpm", "1.2.3 m", "m 3", "1_000 m"])
def test_what_is_no_number_is_kept_whole_for_the_message(text):
    assert number_and_unit(text)[0] == text.split()[0]

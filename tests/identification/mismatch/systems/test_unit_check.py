"""Laws of the units of equations: consistent units pass; a wrong unit is located."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.systems.model_file import load_model_file
from slipbench.identification.mismatch.systems.unit_check import in_words, unit_faults
from slipbench.protocol.units import powers_of
from tests.identification.mismatch.spring import MODEL
from tests.paths import MODELS

UNITS = ("m", "kg", "s", "V", "A", "N", "rad", "1", "N*m/rad", "km/h", "rpm", "V^0.5/s", "%", "K")


def faults(tmp_path, text: str) -> tuple[str, ...]:
    path = tmp_path / "spring.toml"
    path.write_text(text, encoding="utf-8")
    return unit_faults(load_model_file(path), path.name)


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.toml")), ids=lambda p: p.stem)
def test_the_units_of_the_examples_agree(path) -> None:
    assert unit_faults(load_model_file(path), path.name) == ()


@pytest.mark.parametrize(
    ("right", "wrong", "where"),
    [
        ('unit = "N/kg/V"', 'unit = "N/kg"', "states.velocity.rate"),
        ('value = 10, unit = "rad/s"', 'value = 10, unit = "1"', "states.velocity.rate"),
        ('rate = "velocity"', 'rate = "position"', "states.position.rate"),
        ('value = "position"\nsize = { value = 1, unit = "m" }\nalong',
         'value = "velocity"\nsize = { value = 1, unit = "m" }\nalong', "seams.deflection.value"),
    ],
)  # fmt: skip
def test_one_wrong_unit_is_found_in_its_equation(tmp_path, right, wrong, where) -> None:
    assert right in MODEL
    assert faults(tmp_path, MODEL) == ()
    (found,) = faults(tmp_path, MODEL.replace(right, wrong, 1))
    assert found.startswith(f"spring.toml: {where}: units do not agree: ")


def rate(equation: str) -> str:
    return MODEL.replace('rate = "velocity"', f'rate = "{equation}"')


@pytest.mark.parametrize(
    "equation",
    [
        "velocity + 0",
        "max(velocity, 0.5)",
        "velocity if position > 0 else -velocity",
        "sqrt(velocity ** 2 + 1)",
        "(velocity ** 3) ** (1 / 3)",
        "velocity * exp(-frequency * time)",
        "frequency * min(abs(position), 2)",
        "velocity * sin(tilt) + velocity * 2",
        "delay(velocity, 0.1) + velocity",
    ],
)
def test_numbers_fit_where_they_stand(tmp_path, equation) -> None:
    assert faults(tmp_path, rate(equation)) == ()


@pytest.mark.parametrize(
    ("equation", "part", "expected", "found"),
    [
        ("velocity + position", "position", "m s^-1", "m"),
        ("velocity * exp(time)", "time", "1", "s"),
        ("velocity if position > force else 0", "force", "m", "V"),
        ("velocity ** position", "position", "1", "m"),
        ("max(velocity, position)", "position", "m s^-1", "m"),
        ("sqrt(position)", "sqrt(position)", "m s^-1", "m^1/2"),
        ("delay(velocity, damping)", "damping", "s", "1"),
        ("delay(position, 0.1)", "delay(position, 0.1)", "m s^-1", "m"),
    ],
)
def test_the_part_that_disagrees_is_told(tmp_path, equation, part, expected, found) -> None:
    (message,) = faults(tmp_path, rate(equation))
    assert message.endswith(f"{expected} is expected, {found} found, in {part}")


@given(st.sampled_from(UNITS), st.sampled_from(UNITS), st.sampled_from("*/"))
def test_units_multiply_as_their_powers_add(one, other, sign) -> None:
    power = 1 if sign == "*" else -1
    left, right = powers_of(one), powers_of(other)
    names = {*left, *right}
    sums = {n: left.get(n, Fraction(0)) + power * right.get(n, Fraction(0)) for n in names}
    assert powers_of(f"({one}){sign}({other})") == {n: p for n, p in sums.items() if p}


def test_amperes_are_told_in_volts() -> None:
    assert in_words(powers_of("V*A")) == in_words(powers_of("W"))
    assert in_words(powers_of("V/s")) == "V s^-1"

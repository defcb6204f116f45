"""Numbers of a script: what rusEFI's parser reads is the number that was meant."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from slipbench.identification.ecu.rusefi_numbers import as_read, literal, parsed

SINGLE = 3e-7  # relative: a few units in the last place of single precision
numbers = st.floats(1e-12, 1e9) | st.floats(-1e9, -1e-12) | st.integers(-100_000, 100_000)


@given(numbers)
@example(1.6880754651491494e-10)  # 17 digits: the parser's power of ten is rounded six times
def test_the_parser_reads_what_was_meant(value):
    text = literal(float(value)).strip("()")
    assert "e" not in text
    assert "." in text
    read = -parsed(text[1:]) if text.startswith("-") else parsed(text)
    assert read == pytest.approx(float(value), rel=SINGLE, abs=1e-20)


@given(numbers)
def test_a_script_as_read_has_exactly_the_values_of_the_parser(value):
    text = literal(abs(float(value)))
    assert float.fromhex(as_read(f"x={text}").removeprefix("x=")) == parsed(text)


def test_the_parser_knows_powers_of_two_exactly():
    assert [parsed(text) for text in ("0.5", "0.25", "16777215.0")] == [0.5, 0.25, 16777215.0]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(ValueError, match="a script cannot hold"):
        literal(value)

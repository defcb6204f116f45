"""An equation has the value that Python gives it; an undefined value is an error."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.systems.arithmetic import CALLS, value_of
from slipbench.identification.mismatch.systems.expression import read_expression

NUMBERS = st.floats(0.1, 3.0).map(lambda x: round(x, 3))
LEAVES = st.one_of(NUMBERS.map(str), st.sampled_from("abc"))


def grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda x: f"-{x}"),
        st.tuples(st.sampled_from(("sin", "tanh", "atan", "abs")), inner).map(
            lambda t: f"{t[0]}({t[1]})"
        ),
        st.tuples(inner, inner, inner, inner).map(
            lambda t: f"({t[0]} if {t[1]} > {t[2]} else {t[3]})"
        ),
        st.tuples(inner, inner).map(lambda t: f"max({t[0]}, {t[1]})"),
    )


@given(text=st.recursive(LEAVES, grown, max_leaves=8), a=NUMBERS, b=NUMBERS, c=NUMBERS)
def test_it_is_the_value_that_python_gives(text, a, b, c):
    known = {"a": a, "b": b, "c": c}
    read_expression(text, known, "here")
    scope = {name: getattr(math, name, None) or CALLS[name] for name in CALLS}
    try:
        expected = eval(text, {"__builtins__": {}}, {**scope, **known})
    except ZeroDivisionError:
        with pytest.raises(ZeroDivisionError):
            value_of(text, known)
        return
    assert value_of(text, known) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("text", ["1 / (a - a)", "sqrt(-a)", "log(0 * a)", "(0 - a) ** 0.5"])
def test_what_has_no_value_is_an_error(text):
    with pytest.raises((ArithmeticError, ValueError)):
        value_of(text, {"a": 2.0})


def test_a_delayed_quantity_that_stands_still_has_its_value():
    assert value_of("2 * delay(a * a, time)", {"a": 3.0, "time": 0.1}) == 18.0

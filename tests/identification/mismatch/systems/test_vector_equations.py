"""The equations of the elements are the equation of the vector: numpy has the same numbers."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from slipbench.identification.mismatch.systems.arithmetic import value_of
from slipbench.identification.mismatch.systems.expression import read_expression
from slipbench.identification.mismatch.systems.vectors.element import MOST_ELEMENTS, element_names
from slipbench.identification.mismatch.systems.vectors.equation import elements
from slipbench.protocol.errors import InputError

KNOWN = {
    "a": np.array(0.7),
    "b": np.array(-1.3),
    "u": np.array([0.4, -0.9]),
    "v": np.array([1.5, -0.2, 0.6]),
    "w": np.array([-0.8, 0.3, 2.1]),
    "M": np.array([[0.5, -1.0, 0.25], [2.0, 0.1, -0.7], [0.0, 1.1, -0.4]]),
    "N": np.array([[0.9, -0.6, 0.2], [-0.3, 1.4, 0.8]]),
}
SHAPES = {name: value.shape for name, value in KNOWN.items() if value.shape}
NUMBERS = {
    element: float(value[index])
    for name, value in KNOWN.items()
    for index, element in element_names(name, value.shape).items()
}
EVERY = [(), (2,), (3,), (2, 2), (2, 3), (3, 2), (3, 3)]
MIXED = {
    (2, 2): ("[[1, 0], u]", np.array([[1, 0], KNOWN["u"]])),
    (3, 3): ("[[1, 0, 0], v, w]", np.array([[1, 0, 0], KNOWN["v"], KNOWN["w"]])),
}
TextAndValue = tuple[str, Any]
"""Text of an expression and its value in numpy."""


@st.composite
def expressions(draw: st.DrawFn, shape: tuple[int, ...], depth: int) -> TextAndValue:
    """Draw an expression of a shape, of operations so deep."""

    def inner(of: tuple[int, ...]) -> TextAndValue:
        return draw(expressions(of, depth - 1))

    if depth == 0 or draw(st.integers(0, 3)) == 0:
        return draw(leaf(shape))
    if not shape and draw(st.booleans()):
        return number(draw, inner)
    kind = draw(st.sampled_from(["each", "function", "if", "product", "rows", "delay", "minus"]))
    if kind == "rows" and shape:
        rows = [inner(shape[1:]) for _ in range(shape[0])]
        return f"[{', '.join(t for t, _ in rows)}]", np.array([x for _, x in rows])
    if kind == "product" and shape:
        return product(draw, shape, inner)
    return of_each(draw, kind, shape, inner)


def of_each(draw: st.DrawFn, kind: str, shape: tuple[int, ...], inner: Any) -> TextAndValue:
    """Return an element-wise operation on a quantity of the shape and another, or a number."""
    (text, x), other = inner(shape), inner(draw(st.sampled_from([shape, ()])))
    if kind == "function":
        return function(draw, (text, x), other)
    if kind == "if":
        (c, left), (d, right) = inner(()), inner(())
        assume(abs(left - right) > 1e-6)  # rounding decides otherwise
        return f"({text} if {c} < {d} else {other[0]})", (x if left < right else other[1]) + 0 * x
    if kind == "delay":
        return f"delay({text}, a)", x
    if kind == "minus":
        return f"(-{text})", -x
    sign = draw(st.sampled_from("+-*/"))
    if sign == "/":
        return f"({text} / (({other[0]}) ** 2 + 1))", x / (other[1] ** 2 + 1)
    first, last = draw(st.permutations([(text, x), other]))
    values = {"+": np.add, "-": np.subtract, "*": np.multiply}
    return f"({first[0]} {sign} {last[0]})", values[sign](first[1], last[1])


@st.composite
def leaf(draw: st.DrawFn, shape: tuple[int, ...]) -> TextAndValue:
    named: list[TextAndValue] = [(n, x) for n, x in KNOWN.items() if x.shape == shape]
    if shape == (3,):
        row = draw(st.integers(1, 3))
        named.append((f"M[{row}]", KNOWN["M"][row - 1]))
        named += [(f"M[:, {row}]", KNOWN["M"][:, row - 1]), ("w[:]", KNOWN["w"])]
    if shape == (2,):
        first = draw(st.integers(1, 2))
        named.append((f"v[{first}:{first + 1}]", KNOWN["v"][first - 1 : first + 1]))
        named.append((f"N[:, {first}]", KNOWN["N"][:, first - 1]))
    if shape == (2, 2):
        named.append(("M[2:, :2]", KNOWN["M"][1:, :2]))
    if not shape:
        i, j = draw(st.integers(1, 2)), draw(st.integers(1, 3))
        named += [(f"v[{j}]", KNOWN["v"][j - 1]), (f"N[{i}, {j}]", KNOWN["N"][i - 1, j - 1])]
    named += [MIXED[shape]] if shape in MIXED else []
    values = np.array(draw(st.lists(st.sampled_from([0, 1, -1, 2, 0.5]), min_size=9, max_size=9)))[
        : int(np.prod(shape))
    ].reshape(shape)
    return draw(st.sampled_from([*named, (str(values.tolist()), values)]))


def number(draw: st.DrawFn, inner: Any) -> TextAndValue:
    """Return a number of vectors."""
    kind = draw(st.sampled_from(["sum", "norm", "dot", "@"]))
    n = draw(st.sampled_from([(2,), (3,)]))
    (s, x), (t, y) = inner(n), inner(n)
    if kind == "@":
        return f"({s} @ {t})", x @ y
    return {
        "sum": (f"sum({s})", x.sum()),
        "norm": (f"norm({s})", np.linalg.norm(x)),
        "dot": (f"dot({s}, {t})", x @ y),
    }[kind]


def product(draw: st.DrawFn, shape: tuple[int, ...], inner: Any) -> TextAndValue:
    n = draw(st.sampled_from([2, 3]))
    if shape == (3,) and draw(st.booleans()):
        (s, x), (t, y) = inner((3,)), inner((3,))
        return f"cross({s}, {t})", np.cross(x, y)
    if len(shape) == 1 and draw(st.booleans()):
        (s, x), (t, y) = inner((n,)), inner((n, shape[0]))
    else:
        (s, x), (t, y) = inner((shape[0], n)), inner((n, *shape[1:]))
    if len(shape) == 2 and draw(st.booleans()):
        return f"transpose(transpose({t}) @ transpose({s}))", x @ y
    return f"({s} @ {t})", x @ y


def function(draw: st.DrawFn, one: TextAndValue, other: TextAndValue) -> TextAndValue:
    """Return a function of two quantities that is smooth, so that rounding errors stay small."""
    (s, x), (t, y) = one, other
    return {
        "sin": (f"sin({s})", np.sin(x)),
        "tanh": (f"tanh({s})", np.tanh(x)),
        "sqrt": (f"sqrt(abs({s}) + 1)", np.sqrt(np.abs(x) + 1)),
        "power": (f"(abs({s}) + 1) ** tanh({t})", (np.abs(x) + 1) ** np.tanh(y)),
        "max": (f"max({s}, {t})", np.maximum(x, y)),
        "atan2": (f"atan2({t}, abs({s}) + 1)", np.arctan2(y, np.abs(x) + 1)),
    }[draw(st.sampled_from(["sin", "tanh", "sqrt", "power", "max", "atan2"]))]


@settings(max_examples=400)
@given(st.sampled_from(EVERY).flatmap(lambda shape: expressions(shape, 3)))
def test_the_elements_have_the_values_of_numpy(drawn: TextAndValue) -> None:
    text, expected = drawn
    try:
        made = elements(text, SHAPES, "here")
    except InputError as fault:
        if "too" in fault.what:  # long, or deep
            reject()
        raise
    assert made.shape == np.shape(expected)
    found = np.array([value_of(t, NUMBERS) for t in made.flat]).reshape(made.shape)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)
    for element in made.flat:
        read_expression(element, NUMBERS, "here", ["a"])


@pytest.mark.parametrize(
    ("text", "equations"),
    [
        ("[[0, 1], [-1, 0]] @ u", ["u_2", "-u_1"]),
        ("[[2, -1], [0, a]] @ u", ["2 * u_1 - u_2", "a * u_2"]),
        ("a * [1, 0, -1]", ["a", "0", "-a"]),
        ("u * 1 + 0", ["u_1", "u_2"]),
        ("u[2] - u", ["u_2 - u_1", "u_2 - u_2"]),
        ("0 - u", ["-u_1", "-u_2"]),
        ("norm(u)", ["sqrt(u_1 ** 2 + u_2 ** 2)"]),
        ("cross([1, 0, 0], v)", ["0", "-v_3", "v_2"]),
        ("delay(u, [a, b])", ["delay(u_1, a)", "delay(u_2, b)"]),
    ],
)
def test_what_a_literal_matrix_leaves_out_is_not_written(text: str, equations: list[str]) -> None:
    """So a rate may be the name of another state, which friction and stops need to know."""
    assert list(elements(text, SHAPES, "here").flat) == equations


@pytest.mark.parametrize("text", ["a*b  + sin( a )", "delay(a, 1)", "x_1 if a > b else 0"])
def test_an_equation_of_numbers_stays_as_written(text: str) -> None:
    assert elements(text, SHAPES, "here")[()] == text


RANGE = "first:last, both of them included, the first not after the last"
NUMBER, VECTOR, ROWS = "1 number", "3 elements", "3 elements, or rows, after @"


@pytest.mark.parametrize(
    ("text", "expected", "found"),
    [
        ("v + u", VECTOR, "2 elements in u"),
        ("M * v", "3 x 3 elements", f"{VECTOR} in v"),
        ("N @ u", ROWS, "2 elements in u"),
        ("v @ N", ROWS, "2 x 3 elements in N"),
        ("M @ N", ROWS, "2 x 3 elements in N"),
        ("a @ v", "a vector or a matrix beside @", f"{NUMBER} in a"),
        ("max(v, u)", VECTOR, "2 elements in u"),
        ("dot(v, u)", "3 elements in dot", "2 elements in u"),
        ("cross(u, u)", "3 elements in cross", "2 elements in u"),
        ("norm(M)", "a vector in norm", "3 x 3 elements in M"),
        ("sum(a)", "a vector in sum", f"{NUMBER} in a"),
        ("transpose(v)", "a matrix in transpose", f"{VECTOR} in v"),
        ("[v, u]", "3 elements in each row", "2 elements in u"),
        ("[a, v]", "1 number in each row", f"{VECTOR} in v"),
        ("[M, M]", "a number or a row in a list", "3 x 3 elements in M"),
        ("[]", "1 element or more", "0 elements in []"),
        ("v[0]", "an index that is a whole number from 1 to 3", "0 in v[0]"),
        ("v[4]", "an index that is a whole number from 1 to 3", "4 in v[4]"),
        ("v[a]", "an index that is a whole number from 1 to 3", "a in v[a]"),
        ("v[0:2]", "an index that is a whole number from 1 to 3", "0 in v[0:2]"),
        ("v[1:4]", "an index that is a whole number from 1 to 3", "4 in v[1:4]"),
        ("v[3:2]", RANGE, "3:2 in v[3:2]"),
        ("v[1:3:2]", RANGE, "1:3:2 in v[1:3:2]"),
        ("v[:2] + v", "2 elements", f"{VECTOR} in v"),
        ("v[True]", "an index that is a whole number from 1 to 3", "True in v[True]"),
        ("v[1, 2]", "a quantity of 2 indices", f"{VECTOR} in v"),
        ("a[1]", "a quantity of 1 index", f"{NUMBER} in a"),
        ("1 if v > 0 else 2", "1 number in a comparison", f"{VECTOR} in v"),
        ("v if a > 0 else u", VECTOR, "2 elements in u"),
    ],
)
def test_shapes_that_do_not_agree_are_said(text: str, expected: str, found: str) -> None:
    with pytest.raises(InputError) as refused:
        elements(text, SHAPES, "file.toml: states.x.rate")
    assert refused.value.where == "file.toml: states.x.rate"
    assert refused.value.expected == expected
    assert refused.value.found == found


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("v.x", "arithmetic alone"),
        ("v + True", "arithmetic alone"),
        ("v + 'x'", "arithmetic alone"),
        ("(v := 2)", "arithmetic alone"),
        ("v if w else u", "arithmetic alone"),
        ("v // 2", "arithmetic alone"),
        ("v > w", "arithmetic alone"),
        ("[x for x in v]", "arithmetic alone"),
        ("open(v)", "may not be called"),
        ("dot(v)", "may not be called"),
        ("sum(v, axis=0)", "may not be called"),
        ("sin(v, w)", "may not be called"),
        ("v + 1e999", "too large"),
        ("v @@ w", "cannot be read"),
        ("M @ M @ M @ M @ M @ M @ M @ v", "too long"),
        ("+".join(["sum(many)"] * 2), "too many nested"),
        ("many + [[1, 2], [3, 4]] @ u", "do not agree"),
        ("[many, many]", "do not agree"),
    ],
)
def test_what_is_no_arithmetic_of_vectors_is_refused(text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        elements(text, {**SHAPES, "many": (MOST_ELEMENTS,)}, "here")

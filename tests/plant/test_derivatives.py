"""Derivatives made from the text of a function are those of the function."""

import inspect
import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipbench.plant import equations, kernel
from slipbench.plant.derivatives import Derivative, directional, gradient
from slipbench.plant.effects import free_curve
from slipbench.plant.effects.library import LIBRARY, STAND_INS

SEED = 20261125
POINTS = 40
STEP = 1e-6
POSITIVE = (
    *("step", "width", "presliding", "opening", "air_temperature", "body_mass"),
    *("tyre_shape", "tyre_load", "tyre_slip_stiffness", "rear_load", "rear_grip"),
)
PLAIN = [e for e in equations.EQUATIONS if e is not equations.arriving]
HOOKS = [hook.function for effect in LIBRARY for hook in effect.hooks]
FLAT = [*PLAIN, *HOOKS, kernel.off_the_stop]
CURVES = [hook.function for hook in STAND_INS[0].hooks]


def compiled(function: Callable[..., Any], made: Derivative) -> Callable[..., Any]:
    """The function that a derivative's text makes."""
    space = dict(vars(sys.modules[function.__module__]))
    for text in (*made.helpers.values(), made.text):
        exec(text, space)
    return space["made"]


def several(value: Any) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def drawn(names: list[str], rng: np.random.Generator) -> dict[str, float]:
    """Values of either sign, away from zero; those that must be positive are."""
    values = rng.uniform(0.1, 3.0, len(names)) * rng.choice([1.0, 1.0, 1.0, -1.0], len(names))
    return {n: float(abs(v) if n in POSITIVE else v) for n, v in zip(names, values, strict=True)}


@pytest.mark.parametrize("function", FLAT, ids=lambda f: f.__name__)
def test_partial_derivatives_are_central_differences(function: Callable[..., Any]) -> None:
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    names = list(inspect.signature(function).parameters)
    made = gradient(function, "made", [n for n in names if n != "step"])
    derived = compiled(function, made)
    checked = 0
    for x in (drawn(names, rng) for _ in range(POINTS)):
        try:
            value = several(function(**x))
        except ValueError:
            continue  # outside the domain of a root
        found = several(derived(**x))
        np.testing.assert_allclose(found[: made.results], value, rtol=1e-14)
        slopes = dict(zip(made.pairs, found[made.results :], strict=True))
        for name in (n for n in names if n != "step"):
            up = several(function(**{**x, name: x[name] + STEP}))
            down = several(function(**{**x, name: x[name] - STEP}))
            for r in range(made.results):
                expected = (up[r] - down[r]) / (2.0 * STEP)
                assert slopes.get((r, name), 0.0) == pytest.approx(expected, rel=1e-5, abs=1e-5)
        checked += 1
    assert checked > POINTS // 4


@pytest.mark.parametrize("function", CURVES, ids=lambda f: f.__name__)
def test_derivatives_of_curves_are_central_differences(function: Callable[..., Any]) -> None:
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    sizes = {name: len(names) for name, names in STAND_INS[0].tuples.items()}
    names = list(inspect.signature(function).parameters)
    moving = [n for n in names if n not in ("place", "along")]
    derived = compiled(function, directional(function, "made", moving))
    place = float(CURVES.index(function))
    quantities = free_curve.SERVO_QUANTITIES if place == 0 else free_curve.QUANTITIES
    for along in range(len(quantities)):
        x: dict[str, Any] = {n: rng.uniform(0.2, 2.0, sizes.get(n, ())) for n in moving}
        x["knots"] = np.sort(rng.uniform(-3.0, 3.0, sizes["knots"]))
        t = {n: rng.normal(size=np.shape(x[n])) for n in moving}
        fixed = {"place": place, "along": float(along)}
        value, slope = derived(**x, **fixed, **{f"{n}__t": t[n] for n in moving})
        up = function(**{n: x[n] + STEP * t[n] for n in moving}, **fixed)
        down = function(**{n: x[n] - STEP * t[n] for n in moving}, **fixed)
        assert value == function(**x, **fixed)
        assert slope == pytest.approx((up - down) / (2.0 * STEP), rel=1e-5, abs=1e-5)


def test_the_tyre_departs_from_its_formula_from_the_first_step() -> None:
    """A form of zero has the derivative that a small form has."""
    names = list(inspect.signature(equations.tyre_force).parameters)
    forms = [n for n in names if n.startswith("tyre_form")]
    made = gradient(equations.tyre_force, "made", forms)
    derived = compiled(equations.tyre_force, made)
    x = dict.fromkeys(names, 1.0) | dict.fromkeys(forms, 0.0) | {"slip": 0.5}
    assert any(abs(s) > 0.01 for s in derived(**x)[1:])


def _unknown(x: float) -> float:
    while x > 1.0:
        x = 0.5 * x
    return x


def test_what_is_unknown_is_an_error_with_function_and_line() -> None:
    line = inspect.getsourcelines(_unknown)[1] + 1
    with pytest.raises(NotImplementedError, match=f"_unknown, line {line}: .*'While'"):
        gradient(_unknown, "made", ["x"])


def _by_hypot(x: float) -> float:
    return math.hypot(x, 1.0)


def test_an_unknown_call_is_an_error() -> None:
    with pytest.raises(NotImplementedError, match=r"_by_hypot, .*'math.hypot'"):
        gradient(_by_hypot, "made", ["x"])


def _at_most(x: float) -> float:
    return min(3.0 * x if x > 1.0 else 2.0 - x, 6.0)


@pytest.mark.parametrize(("x", "slope"), [(0.5, -1.0), (1.5, 3.0), (2.5, 0.0)])
def test_a_choice_inside_a_minimum_has_the_derivative_of_its_branch(x: float, slope: float) -> None:
    derived = compiled(_at_most, gradient(_at_most, "made", ["x"]))
    assert derived(x) == (_at_most(x), slope)

"""Derivatives of a score: by values, and with a jointly fitted noise model."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from slipbench.identification.mismatch.fit.slopes import in_noise
from slipbench.identification.mismatch.fit.whitening import whitener
from slipbench.identification.mismatch.simulation.causal_partition import OutputGroup
from slipbench.identification.mismatch.simulation.coordinates import LEAST, Coordinate

ROWS, LAGS = 6000, 3


def example(seed: int, outputs: int):
    """Sensitivities (T, m, 2) and residuals (T, m): a waveform explained with delay."""
    rng = np.random.default_rng(seed)
    waveform = lfilter([0.3], [1.0, -0.7], rng.standard_normal((ROWS + 40, outputs)), axis=0)
    residuals = waveform[20:-20] + 0.3 * rng.standard_normal((ROWS, outputs))
    slopes = np.stack((waveform[19:-21], waveform[8:-32]), axis=2)
    return slopes, residuals


def least_squares(slopes, residuals):
    """Objective with a fitted noise model, whitened sensitivities, and the fit for `in_noise`."""
    white = whitener([residuals], LAGS)
    value = 0.5 * (float(np.sum(white(residuals) ** 2)) + white.log_determinant(len(residuals)))
    columns = white(slopes).reshape(residuals.size, -1)
    block = OutputGroup("motion", "motion", ("speed",), LAGS, np.inf)
    partition = SimpleNamespace(groups=(block,))
    fit = SimpleNamespace(
        model=SimpleNamespace(partition=partition), noise=[white], residuals=[[residuals]]
    )
    return value, columns, white(residuals).ravel(), fit


def normals(slopes, residuals):
    """Normal matrix at a fixed noise model, and with the noise model fitted jointly."""
    _, columns, _, fit = least_squares(slopes, residuals)
    inside = in_noise(fit, columns)
    fixed = columns.T @ columns
    return fixed, fixed - inside.T @ inside


def at_its_best(slopes, residuals, along: bool, steps: int):
    found = []
    for _ in range(steps):
        value, columns, whitened, _ = least_squares(slopes, residuals)
        found.append(value)
        step = np.linalg.solve(normals(slopes, residuals)[along], columns.T @ whitened)
        residuals = residuals - slopes @ step
    return residuals, found


@pytest.mark.parametrize("outputs", [1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_second_derivative_of_the_score_at_its_best(seed, outputs):
    print(f"seed {seed}")
    slopes, residuals = example(seed, outputs)
    best, _ = at_its_best(slopes, residuals, along=True, steps=12)
    fixed, along = normals(slopes, best)
    direction = np.array([1.0, 0.0])
    step = 0.3 / np.sqrt(along[0, 0])
    values = [
        least_squares(slopes, best - s * step * (slopes @ direction))[0] for s in (-1.0, 0.0, 1.0)
    ]
    bent = float(np.dot(values, (1.0, -2.0, 1.0))) / step**2
    assert along[0, 0] == pytest.approx(bent, rel=0.1)
    assert fixed[0, 0] > 1.5 * bent  # a step would be two thirds of what is needed, or less


@pytest.mark.parametrize("seed", range(3))
def test_steps_lead_to_the_end_sooner(seed):
    print(f"seed {seed}")
    slopes, residuals = example(seed, 1)
    _, along = at_its_best(slopes, residuals, along=True, steps=4)
    _, alternating = at_its_best(slopes, residuals, along=False, steps=4)
    _, end = at_its_best(slopes, residuals, along=False, steps=60)
    assert end[-1] == pytest.approx(at_its_best(slopes, residuals, True, 30)[1][-1], abs=0.01)
    assert along[-1] - end[-1] < 0.5 * (alternating[-1] - end[-1])


@pytest.mark.parametrize("seed", range(5))
def test_what_noise_follows_is_never_more_than_the_whole(seed):
    """The normal matrix stays positive definite with faded lags, too."""
    print(f"seed {seed}")
    slopes, residuals = example(seed, 2)
    for memory in (1.0, 5.0, np.inf):
        _, columns, _, fit = least_squares(slopes, residuals)
        block = OutputGroup("motion", "motion", ("speed",), LAGS, memory)
        fit.model.partition.groups = (block,)
        inside = in_noise(fit, columns)
        eigenvalues = np.linalg.eigvalsh(columns.T @ columns - inside.T @ inside)
        assert eigenvalues.min() > 0.0


def test_nothing_uncertain_has_no_slopes():
    slopes, residuals = example(0, 2)
    fit = least_squares(slopes, residuals)[-1]
    assert in_noise(fit, np.empty((residuals.size, 0))).shape[1] == 0


@given(
    st.floats(1e-3, 1e3),
    st.floats(1e-3, 5.0),
    st.floats(-4.0, 4.0),
    st.floats(-10.0, 10.0),
    st.booleans(),
)
def test_a_step_changes_the_value_in_proportion(value, scale, x, step, linear):
    number = Coordinate("chassis", "mass", value, scale, linear)
    before, after = number.at(x), number.at(number.moved(x, step))
    if linear:
        assert after == pytest.approx(before + number.slope(x) * step, rel=1e-9)
    else:
        assert after == pytest.approx(before * max(1.0 + scale * step, LEAST), rel=1e-9)
        assert after > 0.0

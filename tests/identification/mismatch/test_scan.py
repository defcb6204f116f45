"""Curves are detected in any units, and once for equal quantities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.curves.scan import RIDGE, _cross_predicted, _shrunk, _solved
from slipbench.identification.mismatch.simulation.regressor import kind_of, quantity_of, with_kinds
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 12.0))
def test_dependent_columns_of_any_size_have_a_solution(seed, exponent):
    """As where a system offset equals the sum of the knots and is projected out."""
    rng = np.random.default_rng(seed)
    columns = 10.0**exponent * rng.standard_normal((200, 6))
    columns[:, 5] = columns[:, :5].sum(axis=1)
    residuals = rng.standard_normal(200)
    solution = _solved(columns.T @ columns, columns.T @ residuals, columns)
    best = columns @ np.linalg.lstsq(columns, residuals, rcond=1e-9)[0]
    shrunk = RIDGE / (RIDGE + 10.0 ** (2.0 * exponent) * 50.0)  # by the ridge, if columns are small
    explained = columns @ solution
    assert np.all(np.isfinite(solution))
    assert np.linalg.norm(explained - best) <= (shrunk + 1e-3) * np.linalg.norm(best)
    predicted = _cross_predicted(columns, residuals, np.arange(200) // 10)
    assert np.all(np.isfinite(predicted))


@given(st.integers(0, 2**32 - 1))
def test_a_knot_that_one_fold_alone_reaches_is_not_predicted_from_the_others(seed):
    """The other folds determine it by a hundredth of a sample, as nuisances leave it to them."""
    rng = np.random.default_rng(seed)
    clusters = np.arange(400) // 10
    columns = rng.standard_normal((400, 6))
    columns[clusters % 4 != 0, 5] *= 0.01
    true = columns[:, :5] @ [1.0, 0.8, 0.6, 0.5, 0.4]
    predicted = _cross_predicted(columns, true + rng.standard_normal(400), clusters)
    there = clusters % 4 == 0
    assert np.sum((predicted - true)[there] ** 2) < 2.0 * np.sum(true[there] ** 2)


@given(st.integers(0, 2**32 - 1))
def test_values_that_many_samples_determine_are_those_of_least_squares(seed):
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((3000, 7))
    residuals = columns @ rng.uniform(1.0, 2.0, 7) + rng.standard_normal(3000)
    normal, gradient = columns.T @ columns, columns.T @ residuals
    plain = np.linalg.lstsq(columns, residuals)[0]
    assert _shrunk(normal, gradient, columns) == pytest.approx(plain, rel=0.02)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 6.0))
def test_rounding_below_zero_in_a_normal_matrix_leaves_a_solution(seed, exponent):
    """Nuisances of a bad condition leave a hundred-millionth of the energy, of either sign."""
    rng = np.random.default_rng(seed)
    columns = 10.0**exponent * rng.standard_normal((200, 6))
    normal = columns[:, :3].T @ columns[:, :3]
    normal = np.pad(normal, (0, 3)) - 1e-8 * np.max(normal) * np.diag([0, 0, 0, 1, 1, 1])
    gradient = np.concatenate((columns[:, :3].T @ rng.standard_normal(200), np.zeros(3)))
    assert np.all(np.isfinite(_shrunk(normal, gradient, columns)))


WAVES = {"a": [1.0, 2.0], "b": [1.0, 2.0]}
THREE_INPUTS = """
name = "Three inputs"
step = "10 ms"
period = "10 ms"

[parameters]
rate = { value = 3, unit = "1/s" }

[inputs]
a = { role = "a", size = { value = 1, unit = "m" } }
b = { role = "b", size = { value = 1, unit = "m" } }
c = { role = "c", size = { value = 1, unit = "m" } }

[states.x]
rate = "rate * (a + b + c - x)"
size = { value = 1, unit = "m" }

[seams.level]
value = "x"
size = { value = 1, unit = "m" }

[outputs.shown]
role = "shown"
value = "level"
size = { value = 1, unit = "m" }
"""


@pytest.mark.parametrize("excited", ["a", "b", "c"])
def test_inputs_that_rest_together_in_one_recording_keep_their_regressors(tmp_path, excited):
    """One input at a time is excited: those at rest have the same waveform in that recording."""
    path = tmp_path / "three.toml"
    path.write_text(THREE_INPUTS, encoding="utf-8")
    system = ModelSystem.load(path)
    time = 0.01 * np.arange(600)
    waves = {n: np.sin(5.0 * time) * (n == excited) for n in "abc"} | {"shown": np.sin(3.0 * time)}
    roles = RoleMap(
        title="three",
        quantities=dict.fromkeys(waves, "m"),
        roles={r: Source(column=r) for r in waves},
    )
    channels = {r: Channel(r, time, y, "m", "bus", "made") for r, y in waves.items()}
    record = system.prepare(Recording(tmp_path, {}, None, roles, channels, {}))
    partition = system.partition([record])
    subsystem = partition.groups[0].subsystem
    found = system.regressors(SimulationInput.undisturbed(record, partition, subsystem))
    assert {f"past of {n}" for n in "abc"} <= set(found)
    assert {f"hysteresis of {n}" for n in "abcx"} <= set(found)
    assert not any(quantity_of(n) in ("level", "shown") and kind_of(n) for n in found)


@pytest.mark.parametrize("missing", ["a", "b"])
def test_regressors_of_a_quantity_that_is_not_recorded_are_left_out(missing):
    waves = {name: np.array(WAVES[name]) for name in "ab" if name != missing}
    found = with_kinds(waves, "ab", "ab", "ab", [("a", "b"), ("b", "a")])
    assert {quantity_of(name) for name in found} == set(waves)
    assert len(found) == 4

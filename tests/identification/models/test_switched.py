"""Laws of switched linear systems: simulation, fit on steps, comparison on sweeps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from slipbench.identification.models.experiment import Experiment
from slipbench.identification.models.model_comparison import compare, nrmse, rival
from slipbench.identification.models.steps import Bundle, Steps
from slipbench.identification.models.switched import (
    Direction,
    SwitchedModel,
    observability_form,
    opening,
    polynomials,
    simulate,
)
from slipbench.identification.models.switched_fit import fit_steps
from slipbench.studies.paper.switched_study import study_of

RATE = 1000.0
RESONANCES = ((53.0, 0.3), (80.0, 0.4))
SLOW = SwitchedModel(Direction(0.17, 4e-3, 0.0), Direction(0.17, 12e-3, 0.0), RESONANCES, 0.0134)
MEAN = Direction(0.17, 8e-3, 0.0)
SAME = replace(SLOW, opening=MEAN, closing=MEAN)


def sweep(amplitude=0.02, seconds=12.0):
    t = np.arange(round(seconds * RATE)) / RATE
    return amplitude * np.sin(2 * np.pi * (0.5 * t + 11.5 * t**2 / (2 * seconds)))


def made_steps(model, seed, noise=2e-4, count=30):
    """Steps of 4 % with white noise below 60 Hz."""
    rng = np.random.default_rng(seed)
    time = np.arange(-100, 380) / RATE
    u = 0.04 * np.clip((time + 0.0033) / 0.0067, 0, 1)
    sides = []
    for mode, sign in ((0, 1), (1, -1)):
        y = simulate(model, sign * u, np.full(u.size, mode), RATE)
        sos = signal.butter(2, 60, fs=RATE, output="sos")
        e = signal.sosfilt(sos, rng.standard_normal((count, u.size + 200)))[:, 200:]
        sides.append(Bundle(np.tile(sign * u, (count, 1)), y + noise * e / e.std()))
    return Steps(time, RATE, *sides)


def experiment(model, u, seed, noise=2e-4):
    y = simulate(model, u, opening(u), RATE)
    y = y + noise * np.random.default_rng(seed).standard_normal(u.size)
    change = np.diff(u, prepend=u[0])
    return Experiment(u, y, RATE, slice(0, u.size), 53.0, {"command": change})


def test_without_a_difference_it_is_the_linear_system_behind_its_delay():
    u = sweep()
    late = np.interp(np.arange(u.size) - SAME.delay * RATE, np.arange(u.size), u, left=0.0)
    system = SAME.to_control()
    exact = signal.lsim((system.A, system.B, system.C, system.D), late, np.arange(u.size) / RATE)[1]
    error = simulate(SAME, u, opening(u), RATE) - exact
    assert np.abs(error).max() < 1e-3 * np.abs(exact).max()


@given(seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_without_a_difference_the_mode_does_not_matter(seed):
    u, rng = sweep(seconds=2.0), np.random.default_rng(seed)
    told = [simulate(SAME, u, rng.integers(0, 2, u.size), RATE) for _ in range(2)]
    assert np.allclose(*told, atol=1e-12)


@given(scale=st.floats(1e-3, 1e3))
@settings(max_examples=20, deadline=None)
def test_twice_the_input_is_twice_the_answer(scale):
    """Switched by the input's own slope it is homogeneous, though not additive."""
    u = sweep(seconds=2.0)
    one, other = (simulate(SLOW, a * u, opening(a * u), RATE) for a in (1.0, scale))
    assert np.allclose(other, scale * one, rtol=1e-9, atol=1e-12 * scale)


def test_the_output_does_not_jump_at_a_switch():
    u = sweep()
    y = simulate(SLOW, u, opening(u), RATE)
    assert np.abs(np.diff(y)).max() < 2 * np.pi * 14 * np.abs(y).max() / RATE


def test_the_observability_form_has_the_transfer_function():
    top, bottom = polynomials(SLOW, 1)
    a, b, c = observability_form(top, bottom)
    for s in 2j * np.pi * np.array([0.5, 5.0, 12.0]):
        assert c @ np.linalg.solve(s * np.eye(len(a)) - a, b) == pytest.approx(
            np.polyval(top, s) / np.polyval(bottom, s), rel=1e-6
        )


def test_a_hold_keeps_the_direction():
    u = np.array([0.0, 1, 2, 2, 2, 1, 0, 0, 1])
    assert opening(u).tolist() == [0, 0, 0, 0, 0, 1, 1, 1, 0]


def test_python_control_gets_the_same_response():
    own = SLOW.response(np.array([3.0, 9.0]), mode=1, delayed=False)
    theirs = SLOW.to_control(1, ("throttle_command", "slip"))
    assert theirs.input_labels == ["throttle_command"]
    assert np.allclose(theirs(2j * np.pi * np.array([3.0, 9.0])), own)


@pytest.mark.parametrize(("model", "truth"), [(SLOW, 8e-3), (SAME, 0.0)])
def test_the_difference_of_lags_is_recovered_within_its_interval(model, truth):
    """Over seeds: unbiased, and inside the 95 % interval as often as it should be."""
    found = [fit_steps(made_steps(model, seed), 2).difference("lag") for seed in range(5)]
    inside = [abs(value - truth) <= half for value, half in found]
    print("seeds 0..4:", [f"{1e3 * v:.2f} +- {1e3 * h:.2f} ms" for v, h in found])
    assert np.mean([value for value, _ in found]) == pytest.approx(truth, abs=5e-4)
    assert sum(inside) >= 4


def test_steps_choose_as_many_resonances_as_there_are():
    one = SwitchedModel(SLOW.opening, SLOW.closing, RESONANCES[:1], SLOW.delay)
    assert len(fit_steps(made_steps(one, 3)).model.resonances) == 1
    assert len(fit_steps(made_steps(SLOW, 3)).model.resonances) == 2


@pytest.mark.parametrize(("truth", "better"), [(SLOW, True), (SAME, False)])
def test_the_switched_model_wins_on_unseen_sweeps_only_where_there_is_something_to_win(
    truth, better
):
    steps, runs = made_steps(truth, 1), [experiment(truth, sweep(), 7)]
    study = study_of(steps, runs, runs)
    print(f"ratio {study.rows[1].ratio:.3f}, {study.rows[1].interval}")
    assert study.rows[1].better is better
    if not better:
        assert study.rows[1].ratio == pytest.approx(1.0, abs=0.02)


def test_the_true_model_leaves_the_noise_and_no_harmonics():
    run = experiment(SLOW, sweep(), 5)
    row = compare([rival("truth", SLOW)], [run])[0]
    assert row.time == pytest.approx(2e-4 / np.std(run.y), rel=0.05)
    assert row.frequency < 0.02
    assert nrmse(run, np.zeros_like(run.y)) == pytest.approx(1.0)

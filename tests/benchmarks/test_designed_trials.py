"""The study of designed trials: its counting, and the hypotheses that a planned trial leaves open."""

from functools import cache

import numpy as np
import pytest

from benchmarks.designed_trials.case import VISIBLE, draw_case
from benchmarks.designed_trials.day import MOST, Day, Result
from benchmarks.designed_trials.page import POLICIES, page, row
from slipbench.identification.experiments.evidence import expected_evidence, rehearsed
from slipbench.identification.experiments.hypothesis import NOTHING, Hypothesis
from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.motorcycle.menu import RPM, Choice
from slipbench.identification.mismatch.thresholds import EXCITED, INDISTINGUISHABLE, REQUIRED_GAIN
from tests.identification.mismatch.test_small import started


def day(policy: str, runs: int, left: tuple[str, ...], why: str = "") -> Day:
    return Day(policy, runs, 16.5 * runs, left, 0, why)


def result(number: int, *runs: int) -> Result:
    """A case that each policy settles after so many runs; one that rode all of them did not."""
    names = ("backlash", NOTHING)
    left = [("backlash",) if n < MOST else names for n in runs]
    days = tuple(day(p, n, stands) for p, n, stands in zip(POLICIES, runs, left, strict=True))
    return Result(number, names, "backlash", days, 300.0)


def test_a_result_reads_back_as_it_was_written():
    one = result(3, 1, 2, MOST)
    assert Result.read(one.written()) == one
    not_ridden = Result(4, (), "", (), 0.0, "a planned trial tripped")
    assert Result.read(not_ridden.written()) == not_ridden


def test_runs_saved_are_those_of_all_cases_together():
    """Three cases of 1, 1 and 2 runs against 2, 3 and 6: 4 of 11."""
    text = page([result(0, 1, 2, MOST), result(1, 1, 3, MOST), result(2, 2, MOST, MOST)], 1)
    assert "Designed trials take 64 % fewer runs than the menu" in text
    assert "Designed trials take 78 % fewer runs than the fixed plan" in text
    assert "| settled | 3 of 3 | 2 of 3 | 0 of 3 |" in text


def test_what_found_no_trial_counts_with_all_runs():
    given_up = Result(
        0,
        ("squat", "load_transfer"),
        "squat",
        (
            day("designed", 0, ("squat", "load_transfer"), "no trial"),
            day("menu", 1, ("squat",)),
            day("fixed plan", 1, ("load_transfer",)),
        ),
        300.0,
    )
    assert row(given_up).endswith("| 0 open, no trial | 1 right | 1 wrong |")
    text = page([given_up], 1)
    assert f"| trials, mean | {MOST:.2f} | 1.00 | 1.00 |" in text
    assert "| the true one was rejected (goal: at most 5%) | 0 of 1 | 0 of 1 | 1 of 1 |" in text


@cache
def planned() -> tuple[Linearization, ...]:
    model = started().training
    known = start_fit(model, model.origin())
    sweep = Choice(2, 11000.0 * RPM, "throttle", "linear_sweep", 0.015, 0.5, 12.0, 6.0)
    return (rehearsed(known, sweep),)


def nats(one: Hypothesis, other: Hypothesis) -> float:
    return sum(expected_evidence(linear, [(one, other)]).least for linear in planned())


@pytest.mark.parametrize("seed", range(3))
def test_an_effect_that_was_not_excited_would_not_have_shown(seed):
    case = draw_case(np.random.default_rng(seed), planned(), alike=False)
    effect, nothing = case.question
    assert nothing.name == NOTHING
    assert bool(case.effects) == (case.truth != NOTHING)
    at_typical = Hypothesis(effect.candidate)
    assert nats(at_typical, nothing) < EXCITED


@pytest.mark.parametrize("seed", range(3))
def test_effects_that_are_alike_show_as_much_and_are_not_told_apart(seed):
    case = draw_case(np.random.default_rng(seed), planned(), alike=True)
    true, *others = (Hypothesis(h.candidate) for h in case.question)
    assert case.truth == true.name
    assert others
    low, high = 0.8 * REQUIRED_GAIN * VISIBLE[0], 1.2 * REQUIRED_GAIN * VISIBLE[1]
    for one in (true, *others):
        assert low < nats(one, Hypothesis()) < high
    assert all(nats(true, other) < INDISTINGUISHABLE for other in others)

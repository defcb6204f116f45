"""Laws of the sequential test: the true hypothesis is hardly ever rejected, however often one looks."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.experiments.sequential_test import (
    LEVEL,
    RunEvidence,
    log_e_values,
    rejected,
    settled,
    standing,
)

SEED = 2024
DAYS, LOOKS = 2000, 15
MEANS = {"nothing": 0.0, "small": 0.7, "large": 1.5}
NAMES = tuple(MEANS)
DENSITIES = st.lists(
    st.fixed_dictionaries({name: st.floats(-500.0, 500.0) for name in NAMES}), max_size=6
)


def runs_of(rows, power=1.0):
    return [RunEvidence(f"run-{n}", row, power) for n, row in enumerate(rows)]


def day(truth: str, noise: float, power: float, rng: np.random.Generator) -> list[RunEvidence]:
    """Runs of a day. A run shows a number whose mean the hypotheses state, with unit noise.

    Each run is designed: how large its excitation is depends on what the runs before it showed.
    """
    runs, size = [], 1.0
    for n in range(LOOKS):
        value = rng.normal(size * MEANS[truth], noise)
        density = {name: -0.5 * (value - size * mean) ** 2 for name, mean in MEANS.items()}
        runs.append(RunEvidence(f"run-{n}", density, power))
        size = 1.5 if value > 0.35 * size else 0.4
    return runs


def share(truth: str, noise: float, power: float, of: str) -> float:
    """Share of days on which a hypothesis is rejected at any look."""
    rng = np.random.default_rng(SEED)
    print(f"seed {SEED}")
    return sum(of in rejected(NAMES, day(truth, noise, power, rng)) for _ in range(DAYS)) / DAYS


def upper(level: float) -> float:
    """Largest share of so many days that chance permits at a true rate, at 4 sigma."""
    return level + 4.0 * math.sqrt(level * (1.0 - level) / DAYS)


@pytest.mark.parametrize("truth", NAMES)
@pytest.mark.parametrize(("noise", "power"), [(1.0, 1.0), (1.4, 0.5)])
def test_the_true_hypothesis_is_rejected_at_the_level_at_most_over_all_looks(truth, noise, power):
    """Where errors are larger than stated, a power of one over their variance keeps the level."""
    assert share(truth, noise, power, truth) <= upper(LEVEL)


def test_a_false_hypothesis_is_rejected_on_most_days():
    assert share("large", 1.0, 1.0, "nothing") > 0.9


def test_larger_errors_than_stated_break_the_level_at_full_power():
    """What the guarantee requires of the densities is needed: the law above can fail."""
    assert share("small", 2.0, 1.0, "small") > upper(LEVEL)


@given(DENSITIES, st.floats(0.0, 1.0))
def test_what_is_rejected_stays_rejected_and_at_least_one_look_did_it(rows, power):
    runs = runs_of(rows, power)
    counts = [set(rejected(NAMES, runs[:n])) for n in range(len(runs) + 1)]
    assert counts[0] == set()
    assert all(a <= b for a, b in pairwise(counts))
    assert settled(NAMES, runs) == (len(standing(NAMES, runs)) <= 1)


@given(DENSITIES)
def test_evidence_is_relative_and_a_power_of_nothing_gives_none(rows):
    """A run that all hypotheses predict alike changes nothing; at power 0 no run does."""
    same = [*runs_of(rows), RunEvidence("same", dict.fromkeys(NAMES, -7.0))]
    before, after = log_e_values(NAMES, runs_of(rows)), log_e_values(NAMES, same)
    assert all(after[name] == pytest.approx(before[name], abs=1e-6) for name in NAMES)
    assert set(log_e_values(NAMES, runs_of(rows, 0.0)).values()) <= {0.0}
    assert min(before.values()) <= 1e-9, "not all can be improbable beside the others"

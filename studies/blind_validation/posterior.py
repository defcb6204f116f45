"""Whether the ranks of the truth in the stated posteriors are uniform: simulation-based calibration.

Talts et al., "Validating Bayesian inference algorithms with simulation-based calibration",
arXiv:1804.06788 (2018). Two numbers of one effect are not quite independent, so the p-values are a
little too small.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.studies.blind_validation.score import ScoredCase

FEWEST = 10  # ranks, below which nothing is tested
PER_BIN = 10  # ranks expected in a bin, about
MOST_BINS = 10


@dataclass(frozen=True)
class Uniformity:
    """distance, ks: of Kolmogorov and Smirnov, and its p-value; chi_square: p-value over the bins.

    band: counts between which 99 % of the bins lie where ranks are uniform.
    """

    ranks: tuple[float, ...]
    counts: tuple[int, ...]
    distance: float
    ks: float
    chi_square: float
    band: tuple[int, int]


def ranks_of(cases: Iterable[ScoredCase], careless: bool = False) -> list[float]:
    """Ranks of the truth in the stated posteriors; those of careless vehicle files apart.

    Posteriors as narrow as the allowance for another formula are left out: where the formula is the
    same, the truth is nearly in their middle.
    """
    estimates = (e for c in cases for e in c.numbers if e.careless == careless)
    return [e.rank for e in estimates if math.isfinite(e.rank) and e.from_recordings]


def uniformity(ranks: Iterable[float]) -> Uniformity | None:
    """Tests of uniformity; None where there are too few ranks."""
    found = tuple(sorted(ranks))
    if len(found) < FEWEST:
        return None
    bins = min(max(len(found) // PER_BIN, 2), MOST_BINS)
    counts = np.histogram(found, bins, (0.0, 1.0))[0]
    ks = stats.kstest(found, "uniform")
    low, high = stats.binom.interval(0.99, len(found), 1.0 / bins)
    return Uniformity(
        found,
        tuple(int(c) for c in counts),
        float(ks.statistic),
        float(ks.pvalue),
        float(stats.chisquare(counts).pvalue),
        (int(low), int(high)),
    )

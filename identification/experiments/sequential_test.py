"""Test of hypotheses after every run that stays valid however often one looks, and whenever one stops.

Each run is predicted under each hypothesis from the runs before it. With p_h(r) the predictive density
of run r under h, the e-value against h after n runs is

    E_h(n) = mean over the others g of  product over r of  (p_g(r) / p_h(r)) ** power

If h is true, each factor has an expectation of at most one given the runs before it: exactly one at
power 1, at most one below it, by Jensen's inequality. So the product is a nonnegative supermartingale,
and so is the mean of several. By Ville's inequality P(E_h(n) >= 1 / level for any n) <= level. h is
rejected from the first such n on: the hypothesis that is true is rejected at all with a probability of
at most `level`, over all looks together. Which run comes next, and whether one does, may follow from all
runs before it (optional continuation).

Grünwald, de Heide and Koolen, "Safe testing", Journal of the Royal Statistical Society, Series B, 86
(2024), 1091-1128. The guarantee holds where the true hypothesis is among these and its predictive
density is right; `power` below 1 makes it hold for errors with that much more variance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

LEVEL = 0.05
"""Probability of rejecting the true hypothesis, at most: an e-value of 20."""


@dataclass(frozen=True)
class RunEvidence:
    """Logarithmic predictive density of a run under each hypothesis, nats, from the runs before it.

    power: share of the log-likelihood ratios that counts, 0 to 1
    """

    run: str
    log_density: Mapping[str, float]
    power: float = 1.0


def log_e_values(names: Sequence[str], runs: Sequence[RunEvidence]) -> dict[str, float]:
    """Logarithm of the e-value against each hypothesis after these runs. names: two or more."""
    total = {name: float(sum(run.power * run.log_density[name] for run in runs)) for name in names}
    return {
        name: _log_mean([total[other] - total[name] for other in names if other != name])
        for name in names
    }


def rejected(
    names: Sequence[str], runs: Sequence[RunEvidence], level: float = LEVEL
) -> dict[str, int]:
    """Hypotheses that are rejected, with the number of runs after which they were for the first time.

    What is rejected once stays rejected.
    """
    found = dict[str, int]()
    for count in range(1, len(runs) + 1):
        for name, value in log_e_values(names, runs[:count]).items():
            if value >= -np.log(level):
                found.setdefault(name, count)
    return found


def standing(
    names: Sequence[str], runs: Sequence[RunEvidence], level: float = LEVEL
) -> tuple[str, ...]:
    """Hypotheses that are not rejected; the true one is among them with probability 1 - level."""
    out = rejected(names, runs, level)
    return tuple(name for name in names if name not in out)


def settled(names: Sequence[str], runs: Sequence[RunEvidence], level: float = LEVEL) -> bool:
    """Whether at most one hypothesis stands: a further run cannot separate anything."""
    return len(standing(names, runs, level)) <= 1


def _log_mean(values: Sequence[float]) -> float:
    most = max(values)
    return most + float(np.log(np.mean(np.exp(np.asarray(values) - most))))

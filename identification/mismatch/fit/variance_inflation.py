"""How far an amplitude may be wrong: errors hang together within stretches of time.

The sum over stretches ("clusters") tells it without a model of the noise, but an effect that acts
in few stretches has few to tell from. So its variance is held towards what is usual for these
residuals, with the weight that the scatter from one signature to the next deserves: the moderated
t of Smyth, "Linear models and empirical Bayes methods for assessing differential expression",
Statistical Applications in Genetics and Molecular Biology 3 (2004).
"""

from dataclasses import dataclass

import numpy as np
from scipy import optimize, special, stats

from slipbench.identification.mismatch.fit.stack import Integers
from slipbench.plant.signals import Floats

FAMILY = 0.05
"""Family-wise level of false alarms, over all that is tried."""
SHARE = 0.5
"""Share of it that the library has; the free curves have the other."""
FEWEST = 3
"""Columns whose scatter can tell what is usual."""
LEAST, MOST = 4.0, 30.0
"""Degrees of freedom that what is usual may have."""


@dataclass(frozen=True)
class VarianceInflation:
    """What is usual: variance over that of white noise, and how many degrees of freedom tell it."""

    inflation: float = 1.0
    freedom: float = MOST

    def moderated(self, robust: Floats, white: Floats, freedom: Floats) -> tuple[Floats, Floats]:
        """Return variance, never below that of white noise, and degrees of freedom.

        robust: variance over stretches; white: that of white noise; freedom: of robust.
        """
        usual = self.freedom * self.inflation * white
        total = self.freedom + freedom
        return np.maximum((usual + freedom * robust) / total, white), total


def stretches(columns: Floats, left: Floats, groups: Integers) -> tuple[Floats, Floats, Floats]:
    """Return robust and white variance of what columns push, and degrees of freedom, (p,) each."""
    pushes = columns * left[:, None]
    push = np.stack([np.bincount(groups, p) for p in pushes.T], axis=1)
    weight = np.stack([np.bincount(groups, c) for c in (columns**2).T], axis=1)
    white = weight.sum(axis=0)
    count = np.maximum(white**2 / np.maximum((weight**2).sum(axis=0), 1e-300), 1.5)
    robust = (push**2).sum(axis=0) * count / (count - 1.0)
    return robust, white, count - 1.0


def fit_variance_inflation(columns: Floats, left: Floats, groups: Integers) -> VarianceInflation:
    """Fit what is usual to the scatter of many columns (rows, p); few tell little of it."""
    if columns.shape[1] < FEWEST:
        return VarianceInflation(freedom=LEAST)
    robust, white, freedom = stretches(columns, left, groups)
    told = (white > 0.0) & (robust > 0.0)
    if told.sum() < FEWEST:
        return VarianceInflation(freedom=LEAST)
    half = 0.5 * freedom[told]
    logs = np.log(robust[told] / white[told]) - special.digamma(half) + np.log(half)
    spread = float(np.var(logs, ddof=1) - np.mean(special.polygamma(1, half)))
    own = _freedom(spread)
    middle = float(np.mean(logs)) + float(special.digamma(0.5 * own)) - np.log(0.5 * own)
    return VarianceInflation(max(float(np.exp(middle)), 1.0), own)


def _freedom(spread: float) -> float:
    """Degrees of freedom of which the logarithm of a mean square scatters with this variance."""
    least, most = (float(special.polygamma(1, 0.5 * f)) for f in (MOST, LEAST))
    if not least < spread < most:
        return MOST if spread <= least else LEAST
    return float(
        optimize.brentq(lambda f: float(special.polygamma(1, 0.5 * f)) - spread, LEAST, MOST)
    )


def amplitude_p(
    course: Floats, left: Floats, groups: Integers, usual: VarianceInflation, least: float = 0.0
) -> float:
    """One-sided p of the amplitude of one course in what is left; `least` does not count."""
    energy = float(course @ course)
    if energy < 1e-6:
        return 1.0
    amplitude = float(course @ left) / energy
    rest = left - amplitude * course
    robust, white, freedom = stretches(course[:, None], rest, groups)
    variance, total = usual.moderated(robust, white, freedom)
    error = float(np.sqrt(variance[0])) / energy
    return float(stats.t.sf((amplitude - least) / error, float(total[0])))

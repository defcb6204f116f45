"""Standard error of an amplitude under errors that are serially correlated within time segments.

The sum over time segments ("clusters") estimates it without a noise model, but an effect that acts
in few clusters has few degrees of freedom. So its variance is shrunk towards a prior variance
inflation of these residuals, with the weight that the variation between effect responses implies:
the moderated t of Smyth, "Linear models and empirical Bayes methods for assessing differential
expression", Statistical Applications in Genetics and Molecular Biology 3 (2004).
"""

from dataclasses import dataclass

import numpy as np
from scipy import optimize, special, stats

from slipbench.identification.mismatch.fit.stack import Integers
from slipbench.plant.signals import Floats

FEWEST = 3
"""Smallest number of columns from which the prior variance inflation is estimated."""
LEAST, MOST = 4.0, 30.0
"""Range of the degrees of freedom of the prior variance inflation."""


@dataclass(frozen=True)
class VarianceInflation:
    """Prior variance inflation: variance over that of white noise, and its degrees of freedom."""

    inflation: float = 1.0
    freedom: float = MOST

    def moderated(self, robust: Floats, white: Floats, freedom: Floats) -> tuple[Floats, Floats]:
        """Return variance, never below that of white noise, and degrees of freedom, (p,) each.

        robust: variance over clusters; white: that of white noise; freedom: of robust; (p,) each.
        """
        prior = self.freedom * self.inflation * white
        total = self.freedom + freedom
        return np.maximum((prior + freedom * robust) / total, white), total


def cluster_variances(
    columns: Floats, residual: Floats, clusters: Integers
) -> tuple[Floats, Floats, Floats]:
    """Return the cluster-robust and the white variance of correlations, and degrees of freedom.

    columns: (rows, p); residual, clusters: (rows,). Returns (p,) each.
    """
    products = columns * residual[:, None]
    cluster_sums = np.stack([np.bincount(clusters, p) for p in products.T], axis=1)
    weight = np.stack([np.bincount(clusters, c) for c in (columns**2).T], axis=1)
    white = weight.sum(axis=0)
    count = np.maximum(white**2 / np.maximum((weight**2).sum(axis=0), 1e-300), 1.5)
    robust = (cluster_sums**2).sum(axis=0) * count / (count - 1.0)
    return robust, white, count - 1.0


def fit_variance_inflation(
    columns: Floats, residual: Floats, clusters: Integers
) -> VarianceInflation:
    """Fit the prior variance inflation to many columns; a weak prior for few.

    columns: shape (rows, p); residual, clusters: shape (rows,).
    """
    if columns.shape[1] < FEWEST:
        return VarianceInflation(freedom=LEAST)
    robust, white, freedom = cluster_variances(columns, residual, clusters)
    usable = (white > 0.0) & (robust > 0.0)
    if usable.sum() < FEWEST:
        return VarianceInflation(freedom=LEAST)
    half_freedom = 0.5 * freedom[usable]
    log_ratios = (
        np.log(robust[usable] / white[usable])
        - special.digamma(half_freedom)
        + np.log(half_freedom)
    )
    spread = float(np.var(log_ratios, ddof=1) - np.mean(special.polygamma(1, half_freedom)))
    prior_freedom = _freedom(spread)
    log_inflation = (
        float(np.mean(log_ratios))
        + float(special.digamma(0.5 * prior_freedom))
        - np.log(0.5 * prior_freedom)
    )
    return VarianceInflation(max(float(np.exp(log_inflation)), 1.0), prior_freedom)


def _freedom(spread: float) -> float:
    """Degrees of freedom of a mean square whose logarithm has this variance."""
    low, high = (float(special.polygamma(1, 0.5 * f)) for f in (MOST, LEAST))
    if not low < spread < high:
        return MOST if spread <= low else LEAST
    return float(
        optimize.brentq(lambda f: float(special.polygamma(1, 0.5 * f)) - spread, LEAST, MOST)
    )


def amplitude_p(
    response: Floats,
    residual: Floats,
    clusters: Integers,
    inflation: VarianceInflation,
    least: float = 0.0,
) -> float:
    """One-sided p of the amplitude of a response in a residual.

    response, residual, clusters: shape (rows,). least: negligible amplitude.
    """
    energy = float(response @ response)
    if energy < 1e-6:
        return 1.0
    amplitude = float(response @ residual) / energy
    remainder = residual - amplitude * response
    robust, white, freedom = cluster_variances(response[:, None], remainder, clusters)
    variance, total = inflation.moderated(robust, white, freedom)
    error = float(np.sqrt(variance[0])) / energy
    return float(stats.t.sf((amplitude - least) / error, float(total[0])))

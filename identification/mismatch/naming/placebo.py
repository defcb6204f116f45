"""Variance inflation of effects with a road position or a period, estimated at placebo locations.

An effect on a section of the road acts in few time segments, which by themselves give few degrees
of freedom for the error of its size: a gust is as long as a slope, and every record has some period
at which its wind is largest. Two comparisons give more. At all other locations, or periods, the
effect should be absent. And at one location all trials should agree: wind and other disturbances
differ from trial to trial.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.identification.mismatch.thresholds import TESTABLE
from slipbench.plant.signals import Floats

APART = 2.0
"""Distance beyond which a location serves as placebo, in steps of the search."""
PLACES = 8
"""Smallest number of placebo locations."""


@dataclass(frozen=True, eq=False)
class PlaceboLocation:
    """One location at which an effect was tested.

    at: in steps of the search. energy, amplitude: of its response in each trial alone, (R,), where
    white noise has a mean square of 1. distinct_share: share of this response that those at the
    other locations do not have, 0 to 1.
    """

    at: float
    energy: Floats
    amplitude: Floats
    distinct_share: float

    @property
    def over_all_trials(self) -> tuple[float, float]:
        """Energy and amplitude over all trials."""
        energy = float(self.energy.sum())
        return energy, float(self.energy @ self.amplitude) / max(energy, 1e-300)


def at_places(
    at: Sequence[float], energy: Floats, amplitude: Floats, alike: Floats
) -> list[PlaceboLocation]:
    """Return the tested locations.

    energy, amplitude: (R, locations); alike: correlations of the responses, (locations, locations).
    """
    distinct_shares = 1.0 / np.maximum(np.sum(alike**2, axis=1), 1.0)
    return [
        PlaceboLocation(a, energy[:, i], amplitude[:, i], float(distinct_shares[i]))
        for i, a in enumerate(at)
    ]


def placebo_inflation(locations: Sequence[PlaceboLocation], at: float) -> VarianceInflation | None:
    """Return the larger variance inflation at one location, over placebo locations or trials."""
    inflations = [
        s for s in (between_places(locations, at), between_trials(locations)) if s is not None
    ]
    return max(inflations, key=lambda s: s.inflation, default=None)


def between_places(locations: Sequence[PlaceboLocation], at: float) -> VarianceInflation | None:
    """Return the variance inflation over placebo locations; None where there are too few."""
    others = [t.over_all_trials for t in locations if abs(t.at - at) > APART]
    squares = [energy * amplitude**2 for energy, amplitude in others if 0.5 * energy > TESTABLE]
    if len(squares) < PLACES:
        return None
    return VarianceInflation(max(1.0, float(np.mean(squares))), len(squares) / APART)


def between_trials(locations: Sequence[PlaceboLocation]) -> VarianceInflation | None:
    """Return the variance inflation between trials; None if only single trials are informative.

    A real effect is present in every trial and does not contribute to it.
    """
    squares = freedom = independent = 0.0
    for location in locations:
        informative = 0.5 * location.energy > TESTABLE
        if informative.sum() < 2:
            continue
        energy, amplitude = location.energy[informative], location.amplitude[informative]
        mean = float(energy @ amplitude) / float(energy.sum())
        squares += float(energy @ (amplitude - mean) ** 2)
        freedom += len(energy) - 1
        independent += (len(energy) - 1) * location.distinct_share
    if freedom == 0.0:
        return None
    return VarianceInflation(max(1.0, squares / freedom), max(independent, 1.0))

"""How the size of what is looked for along the road scatters where it cannot be true.

What acts on a stretch of the road acts in few stretches of time, which by themselves tell too
little of how far its size may be wrong: a gust is as long as a slope. Two things tell more. At all
other places there should be nothing of it. And at one place every trial should show it alike: wind
and whatever else passes by differ from trial to trial.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.plant.signals import Floats

APART = 2.0
"""Steps of the search along the road beyond which another place tells what is usual."""
PLACES = 8
"""Other places that must be there to tell what is usual."""
CHANCE = 1.0
"""Nats below which a try, were its effect there, could not be found; such a try tells nothing."""


@dataclass(frozen=True, eq=False)
class PlaceboLocation:
    """One place at which an effect was tried.

    at: in steps of the search. energy, amplitude: of its signature in each trial alone, (R,),
    where white noise has a square of 1. distinct_share: share of this signature that those at the other
    places do not have, 0 to 1.
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
    """Return what was tried.

    energy, amplitude: (R, places); alike: correlations of the signatures, (places, places).
    """
    own = 1.0 / np.maximum(np.sum(alike**2, axis=1), 1.0)
    return [
        PlaceboLocation(a, energy[:, i], amplitude[:, i], float(own[i])) for i, a in enumerate(at)
    ]


def usual(tried: Sequence[PlaceboLocation], at: float) -> VarianceInflation | None:
    """Return how a size at one place may scatter, as its other places and its trials tell it."""
    told = [s for s in (between_places(tried, at), between_trials(tried)) if s is not None]
    return max(told, key=lambda s: s.inflation, default=None)


def between_places(tried: Sequence[PlaceboLocation], at: float) -> VarianceInflation | None:
    """Return how sizes scatter over places apart from one; None where there are too few."""
    others = [t.over_all_trials for t in tried if abs(t.at - at) > APART]
    squares = [energy * amplitude**2 for energy, amplitude in others if 0.5 * energy > CHANCE]
    if len(squares) < PLACES:
        return None
    return VarianceInflation(max(1.0, float(np.mean(squares))), len(squares) / APART)


def between_trials(tried: Sequence[PlaceboLocation]) -> VarianceInflation | None:
    """Return how sizes at a place differ from trial to trial; None where one trial alone shows it.

    An effect that is there is there in every trial and adds nothing to it.
    """
    squares = freedom = independent = 0.0
    for t in tried:
        tells = 0.5 * t.energy > CHANCE
        if tells.sum() < 2:
            continue
        energy, amplitude = t.energy[tells], t.amplitude[tells]
        mean = float(energy @ amplitude) / float(energy.sum())
        squares += float(energy @ (amplitude - mean) ** 2)
        freedom += len(energy) - 1
        independent += (len(energy) - 1) * t.distinct_share
    if freedom == 0.0:
        return None
    return VarianceInflation(max(1.0, squares / freedom), max(independent, 1.0))

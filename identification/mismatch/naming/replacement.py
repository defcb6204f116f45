"""Effects that replace parameters moved far from the file by calibration.

The library is screened with those parameters fixed at the values of the file. A replacing effect
must gain a sufficient share of what their deviations gained; then everything is fitted again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.fixed import far_numbers_fixed, freed
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import relinearized
from slipbench.identification.mismatch.naming.score import Score, Screening, screen
from slipbench.identification.mismatch.simulation.kept import last_results
from slipbench.identification.mismatch.thresholds import REPLACED_SHARE
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError


@dataclass(frozen=True, eq=False)
class Replacement:
    """A fit, the same with its far parameters fixed, and the scores of a screening there.

    fits: cached fits, by the name of the effect; None where it does not replace them.
    """

    fit: Fit
    fixed: Fit
    scores: Sequence[Score]
    fits: dict[str, Fit | None] = field(default_factory=dict)

    @property
    def least(self) -> float:
        """Gain required of an effect beside the fixed parameters, nats."""
        return REPLACED_SHARE * (self.fit.score - self.fixed.score)

    def fitted(self, score: Score, required: float = -math.inf) -> Fit | None:
        """Return the fit of everything with an effect in their place; None if it does not.

        required: log-posterior below which a fit is not needed, nats.
        """
        name = score.candidate.name
        if name not in self.fits:
            try:
                beside = self._beside(score)
                if beside is not None and self._reach(beside) < required:
                    return None
                self.fits[name] = beside and freed(beside, self.fit.model)
            except PlantError:
                self.fits[name] = None
        return self.fits[name]

    def _beside(self, score: Score) -> Fit | None:
        """Fit beside the fixed parameters until the effect gains enough to replace them."""
        effects = (*self.fixed.candidates, score.as_large_as_scored())
        beside = optimize(with_effects(self.fixed, effects))
        for _ in range(2):
            if beside.score > self.fixed.score + self.least:
                return beside
            beside = optimize(relinearized(beside))
        return None

    def _reach(self, beside: Fit) -> float:
        """Return the log-posterior that a fit may reach once the fixed parameters are freed, nats.

        They gain what they gained without the effect if they are independent of it, and less where
        it replaces them.
        """
        return beside.score + max(self.fit.score - self.fixed.score, 0.0)


@last_results(3)
def replacement(
    fit: Fit, library: tuple[type[Effect], ...], before: Screening | None = None
) -> Replacement | None:
    """Screen a library with the far parameters of a fit fixed; None where it cannot be simulated.

    before: a screening of another fit of the same recordings.
    """
    try:
        fixed = far_numbers_fixed(fit)
    except PlantError:
        return None
    return Replacement(fit, fixed, screen(Linearization.of(fixed), library, before).scores)

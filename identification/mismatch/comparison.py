"""The calibrated system and the system with named effects, compared at one noise model."""

from dataclasses import dataclass, replace

from slipbench.identification.mismatch.curves.adequacy import Remainder, remainder
from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.locate import locate
from slipbench.identification.mismatch.fit.fitting import Fit, with_noise
from slipbench.identification.mismatch.fit.held_out import predicted_gain, refit_on
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.thresholds import DOUBTFUL
from slipbench.plant.errors import PlantError


@dataclass(frozen=True, eq=False)
class Comparison:
    """base: calibrated; fit: with named effects, or `base`; held_out: model of those recordings."""

    base: Fit
    fit: Fit
    held_out: Model | None

    def by_least_squares(self) -> "Comparison":
        """Return the comparison with white noise; both systems are fitted again.

        A noise model that is fitted to an error takes its levels for noise: of a sensor whose scale
        is wrong by 1 % on a section of the road only the two ends of the section were left.
        """
        base = _least_squares(self.base)
        fit = base if self.fit is self.base else _least_squares(self.fit)
        return Comparison(base, fit, self.held_out and self.held_out.with_noise(white=True))

    def curves(self) -> list[Curve]:
        """Return the free curves in the residual of the calibrated system, the best first."""
        return self._curves(self.base)

    def curves_beside_names(self) -> tuple[list[Curve], Remainder | None]:
        """Return the free curves in the residual of the named effects, and what they still explain."""
        curves = self._curves(self.fit)
        return curves, remainder(self.base, self.fit, curves)

    def _curves(self, fit: Fit) -> list[Curve]:
        there = None if self.held_out is None else refit_on(fit, self.held_out)
        curves = locate(Linearization.of(fit), None if there is None else Linearization.of(there))
        factor = DOUBTFUL if fit.model.white else 1.0
        return [replace(c, p=min(1.0, factor * c.p)) for c in curves]

    def names_predict_better(self, gain: float) -> bool:
        """Return whether named effects predict held-out recordings better than a curve.

        gain: held-out gain of the curve in their place, nats: the smaller one of the gain with all
        parameters estimated again, and of that with the parameters of the training recordings. The
        gain of the names is computed in the same way.
        """
        if self.held_out is None:
            return False
        moved = refit_on(self.fit, self.held_out).score - refit_on(self.base, self.held_out).score
        try:
            predicted = predicted_gain(self.held_out, self.base, self.fit, self.held_out)
        except PlantError:  # it cannot be simulated with the parameters of the training recordings
            return False
        return min(moved, predicted) > gain


def _least_squares(fit: Fit) -> Fit:
    return refit_with_updated_jacobian(optimize(with_noise(fit, white=True)))

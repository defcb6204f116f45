"""Free curves fitted in the simulation."""

from dataclasses import dataclass, replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.fit.fitting import Fit, with_noise
from slipbench.identification.mismatch.simulation.model import Model


@dataclass(frozen=True, eq=False)
class FreeCurve:
    """Curves in the simulation.

    curve: the first, as fitted alone; beside: further curves, fitted to its residuals.
    log_likelihood_gain, confirmed: on the training and the held-out recordings, nats. proven: model
    of the held-out recordings for `fit`.
    """

    curve: Curve
    fit: Fit
    log_likelihood_gain: float
    confirmed: float
    proven: Model | None
    beside: tuple[Curve, ...] = ()

    def with_another(self, other: "FreeCurve") -> "FreeCurve":
        """Return both; the other curve was fitted beside this one."""
        return FreeCurve(
            self.curve,
            other.fit,
            self.log_likelihood_gain + other.log_likelihood_gain,
            self.confirmed + other.confirmed,
            other.proven,
            (*self.beside, other.curve),
        )

    def at_fitted_noise(self) -> "FreeCurve":
        """Return the same curves, with a fitted autoregression as the noise."""
        fit, proven = self.fit, self.proven
        if not fit.model.white:
            return self
        model = None if proven is None else proven.with_noise(white=False)
        return replace(self, fit=with_noise(fit, white=False), proven=model)

"""Free curves that stand in the simulation."""

from dataclasses import dataclass

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.model import Model


@dataclass(frozen=True, eq=False)
class FreeCurve:
    """Curves inside the simulation. gain, confirmed: nats on training and held-out runs.

    curve: the first, as it was by itself; beside: those that take up what it leaves. proven: the
    held-out model with which `fit` meets the held-out recordings.
    """

    curve: Curve
    fit: Fit
    log_likelihood_gain: float
    confirmed: float
    proven: Model | None
    beside: tuple[Curve, ...] = ()

    def with_another(self, other: "FreeCurve") -> "FreeCurve":
        """Return both, the other fitted beside this one."""
        return FreeCurve(
            self.curve,
            other.fit,
            self.log_likelihood_gain + other.log_likelihood_gain,
            self.confirmed + other.confirmed,
            other.proven,
            (*self.beside, other.curve),
        )

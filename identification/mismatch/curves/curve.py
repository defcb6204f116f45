"""A free curve f(z) at an injection point, with its log-likelihood gains and p-value."""

from dataclasses import dataclass

from slipbench.identification.mismatch.simulation.regressor import curve_waveform, kind_of
from slipbench.identification.mismatch.thresholds import FALSE_ALARM_RATE, INDISTINGUISHABLE
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class Curve:
    """f(z) at an injection point. knots: of z, SI; values: of f, SI.

    log_likelihood_gain, confirmed: on the training and the held-out recordings, nats. p: p-value of
    its out-of-sample prediction, family-wise over all curves and the library. recorded: whether the
    signal at the place is recorded.
    """

    place: str
    block: str
    unit: str
    regressor: str
    knots: Floats
    values: Floats
    log_likelihood_gain: float
    confirmed: float
    p: float
    recorded: bool = False

    @property
    def kind(self) -> str:
        """Kind of the regressor (see `regressor.kind_of`)."""
        return kind_of(self.regressor)

    @property
    def evidence(self) -> float:
        """Log-likelihood gain on all recordings, nats, as evidence for the place.

        An error of a sensor is less plausible than missing physics of the same gain.
        """
        doubt = INDISTINGUISHABLE if self.recorded else 0.0
        return self.log_likelihood_gain + self.confirmed - doubt

    @property
    def significant(self) -> bool:
        """Whether it is significant and not contradicted by the held-out recordings."""
        return self.p < FALSE_ALARM_RATE

    def __call__(self, z: Floats, step: float = 1.0) -> Floats:
        """Evaluate f on a waveform, constant beyond the end knots. step: period of a row, s."""
        return curve_waveform(self.regressor, z, self.knots, self.values, step)

"""A free curve f(z) at a place, with what recordings say of it."""

from dataclasses import dataclass

from slipbench.identification.mismatch.fit.variance_inflation import FAMILY
from slipbench.identification.mismatch.simulation.regressor import course, kind_of
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class Curve:
    """f(z) at a place. knots: of z, SI; values: of f, SI; gain, confirmed: nats.

    tested: nats that the curve would be worth on the held-out recordings if it were right. p: that
    what it foretells came by chance, family-wise over all curves and the library.
    """

    place: str
    block: str
    unit: str
    regressor: str
    knots: Floats
    values: Floats
    log_likelihood_gain: float
    confirmed: float
    tested: float
    p: float

    @property
    def kind(self) -> str:
        """What its regressor begins with (see `along.kind_of`)."""
        return kind_of(self.regressor)

    @property
    def certain(self) -> bool:
        """Whether it is more than chance, and the held-out recordings do not contradict it."""
        return self.p < FAMILY

    def __call__(self, z: Floats, step: float = 1.0) -> Floats:
        """Evaluate f along a course; beyond the last knots it goes on level. step: s, of a row."""
        return course(self.regressor, z, self.knots, self.values, step)

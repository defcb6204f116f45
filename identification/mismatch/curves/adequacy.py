"""Whether named effects suffice: by the share of the error that a free curve could still take.

Nats grow with the number of samples and with the smallness of the noise. Where a circuit is
recorded with one part in ten thousand, what is left of a right name is worth hundreds of nats, and
still is next to nothing of what the name explains. So what is left is weighed against what is
explained, in nats and in plain mean squares: names suffice where no free curve could take more than
LEFT of what the names took, in one of the two.

    rest = b, without names; n, with them; c, with them and the curve:
    (n^2 - c^2) <= LEFT (b^2 - c^2)
"""

from collections.abc import Iterable
from dataclasses import dataclass

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.trace import effect_of
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import Nuisances, whiten_and_stack
from slipbench.identification.mismatch.fit.whitening import whitener

LEFT = 0.05
"""Share of what names explain that a free curve may find beside them."""


@dataclass(frozen=True)
class Remainder:
    """What names leave to a free curve: a share of what they explain.

    share: in mean squares. nats: in log-likelihood.
    """

    curve: Curve
    share: float
    nats: float = 1.0

    @property
    def small(self) -> bool:
        """Whether the names suffice all the same."""
        return min(self.share, self.nats) <= LEFT

    @property
    def lesser(self) -> bool:
        """Whether the names explain more, in nats, than they leave."""
        return self.nats < 1.0


def remainder(base: Fit, named: Fit, curves: Iterable[Curve]) -> Remainder | None:
    """Return the largest of what certain curves could still take; None where there is none.

    base: without names; named: with them; curves: found in what `named` leaves.
    """
    linear = Linearization.of(named)
    found = [_weighed(base, linear, c) for c in curves if c.certain]
    return max(found, key=lambda r: r.share, default=None)


def _weighed(base: Fit, linear: Linearization, curve: Curve) -> Remainder:
    """Every output counts in its own root mean square, as the names leave it.

    All are taken off what may vary without meaning anything, so that no bad calibration counts as
    explained.
    """
    fit = linear.fit
    even = [whitener(rest, order=0) for rest in fit.residuals]
    free, bare = (
        Nuisances(whiten_and_stack(f.model, even, f.slopes) * f.slope_ratio) for f in (fit, base)
    )
    before = bare.project_out(whiten_and_stack(base.model, even, base.residuals))
    now = free.project_out(whiten_and_stack(fit.model, even, fit.residuals))
    trace = free.project_out(whiten_and_stack(fit.model, even, effect_of(linear, curve)))
    taken = float(trace @ now) ** 2 / max(float(trace @ trace), 1e-300)
    explained = float(before @ before) - (float(now @ now) - taken)
    share = taken / explained if explained > taken else 1.0
    nats = curve.log_likelihood_gain / max(fit.score - base.score, 1e-300)
    return Remainder(curve, share, nats)

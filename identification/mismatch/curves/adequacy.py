"""Adequacy of named effects, from the residual share that a free curve can still explain.

The log-likelihood gain grows with the number of samples and with decreasing noise. Where a circuit
is recorded with a precision of 1e-4, the residual of a correct effect can be worth hundreds of nats
and still be negligible beside what the effect explains. So the remaining gain is compared with the
explained gain, in nats and in mean squares. Named effects are adequate where no free curve explains
more than LEFT of what they explain, in at least one of the two measures. Where it is more in nats,
and in the geometric mean of both, they still give way to one free curve in their place that
predicts held-out recordings better (see explain.py).

    residual norms b, without named effects; n, with them; c, with them and the curve:
    (n^2 - c^2) <= LEFT (b^2 - c^2)
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.trace import effect_of
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import Nuisances, whiten_and_stack
from slipbench.identification.mismatch.fit.whitening import whitener
from slipbench.identification.mismatch.thresholds import RESIDUAL_SHARE


@dataclass(frozen=True)
class Remainder:
    """Improvement by a free curve, relative to what named effects explain.

    share: ratio of mean squares. nats: ratio of log-likelihood gains.
    """

    curve: Curve
    share: float
    nats: float = 1.0

    @property
    def small(self) -> bool:
        """Whether the named effects are adequate."""
        return min(self.share, self.nats) <= RESIDUAL_SHARE

    @property
    def comparable(self) -> bool:
        """Whether adequate names are compared with one curve in their place.

        Their remainder is large in nats, and in the geometric mean of both measures: beside a right
        name, 0.01 % of the mean square is certain where there is little noise.
        """
        both = math.sqrt(self.share * self.nats)
        return min(self.nats, both) > RESIDUAL_SHARE

    @property
    def lesser(self) -> bool:
        """Whether the named effects gain more log-likelihood than the curve."""
        return self.nats < 1.0


def remainder(base: Fit, named: Fit, curves: Iterable[Curve]) -> Remainder | None:
    """Return the largest improvement by significant curves; None where there is none.

    The curve with the largest share, and the largest log-likelihood gain of all of them.

    base: fit without named effects; named: fit with them; curves: located in the residuals of
    `named`.
    """
    linear = Linearization.of(named)
    remainders = [_remainder_of(base, linear, c) for c in curves if c.significant]
    if not remainders:
        return None
    largest = max(remainders, key=lambda r: r.share)
    return replace(largest, nats=max(r.nats for r in remainders))


def _remainder_of(base: Fit, linear: Linearization, curve: Curve) -> Remainder:
    """Return the improvement by one curve.

    Each output is normalized by the root mean square of its residual with named effects. Nuisances
    are projected out of all terms, so that a calibration error does not count as explained.
    """
    fit = linear.fit
    scalings = [whitener(of_group, order=0) for of_group in fit.residuals]
    nuisances, base_nuisances = (
        Nuisances(whiten_and_stack(f.model, scalings, f.slopes) * f.slope_ratio)
        for f in (fit, base)
    )
    residual_before = base_nuisances.project_out(
        whiten_and_stack(base.model, scalings, base.residuals)
    )
    residual_now = nuisances.project_out(whiten_and_stack(fit.model, scalings, fit.residuals))
    response = nuisances.project_out(
        whiten_and_stack(fit.model, scalings, effect_of(linear, curve))
    )
    removed = float(response @ residual_now) ** 2 / max(float(response @ response), 1e-300)
    explained = float(residual_before @ residual_before) - (
        float(residual_now @ residual_now) - removed
    )
    share = removed / explained if explained > removed else 1.0
    nats = curve.log_likelihood_gain / max(fit.score - base.score, 1e-300)
    return Remainder(curve, share, nats)

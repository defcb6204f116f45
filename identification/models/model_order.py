"""Number of poles and zeros that a response supports: every order that fits as well as the best.

    choice = choose_order(lines)
    choice.best.fit.model                          # least AIC
    [row.order for row in choice.within(2.0)]      # all that are within 2 nats of it

Akaike's final prediction error and information criterion, Rissanen's description length. One nat
is half a unit of AIC; within two the data do not distinguish two orders (Burnham and Anderson,
Model Selection and Multimodel Inference, 2nd ed., section 2.6).

An order whose fit has a resonance narrower than the spacing of the lines has described the noise of
one line, for no criterion counts the choice of that line: it is left out.
"""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from slipbench.identification.models.rational_ml import RationalFit, fit_order
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.response.independent_lines import Lines

NATS = 2.0
NEGLIGIBLE = 1e-3  # odds of an order that are not counted
Fit = TypeVar("Fit")


@dataclass(frozen=True)
class Criteria:
    """fpe: in units of the cost per sample; aic, mdl: in units of 2 ln likelihood."""

    fpe: float
    aic: float
    mdl: float


@dataclass(frozen=True)
class Row(Generic[Fit]):
    """One order: its fit, its criteria, and its AIC above the least, in nats."""

    order: Order
    fit: Fit
    criteria: Criteria
    nats: float = 0.0


@dataclass(frozen=True)
class OrderChoice(Generic[Fit]):
    """All candidate orders, the least AIC first."""

    rows: tuple[Row[Fit], ...]

    @property
    def best(self) -> Row[Fit]:
        """The order of least AIC."""
        return self.rows[0]

    @property
    def best_by_fpe(self) -> Row[Fit]:
        """The order of least final prediction error."""
        return min(self.rows, key=lambda row: row.criteria.fpe)

    @property
    def best_by_mdl(self) -> Row[Fit]:
        """The order of least description length."""
        return min(self.rows, key=lambda row: row.criteria.mdl)

    def within(self, nats: float = NATS) -> tuple[Row[Fit], ...]:
        """Every order that is within so many nats of the best."""
        return tuple(row for row in self.rows if row.nats <= nats)


def orders(most_poles: int = 6, most_zeros: int = 3, least_poles: int = 2) -> tuple[Order, ...]:
    """Orders to try: strictly proper ones, for no inertia responds at once."""
    return tuple(
        Order(poles, zeros)
        for poles in range(least_poles, most_poles + 1)
        for zeros in range(min(poles - 1, most_zeros) + 1)
    )


def all_pole(most_poles: int = 6, least_poles: int = 2) -> tuple[Order, ...]:
    """Orders without zeros: lags and springs in a chain, and no second path around them."""
    return orders(most_poles, 0, least_poles)


def choose_order(
    lines: Lines, tried: tuple[Order, ...] | None = None, delay: float | None = None
) -> OrderChoice[RationalFit]:
    """Fit every order that the lines can carry; `delay` (s) holds the delay."""
    samples = 2 * lines.frequency.size
    tried = tried or orders()
    fits = [fit_order(lines, order, delay) for order in tried if 2 * order.size <= samples]
    held = 0 if delay is None else 1
    kept = [fit for fit in fits if resolved(fit.model, lines)] or fits
    return ranked(
        [
            Row(
                f.order,
                f,
                of_likelihood(f.chi_square / lines.inflation, f.order.size - held, samples),
            )
            for f in kept
        ]
    )


def doubted(choice: OrderChoice[RationalFit]) -> RationalFit:
    """The fit of least description length, with the uncertainty of its order.

    Half the difference in description length is near the logarithm of the odds of two orders
    (Schwarz 1978).
    """
    best = choice.best_by_mdl
    lengths = np.array([row.criteria.mdl for row in choice.rows])
    weights = np.exp((best.criteria.mdl - lengths) / 2)
    weights /= np.sum(weights)
    rivals = tuple(
        (float(w), row.fit)
        for w, row in zip(weights, choice.rows, strict=True)
        if row is not best and w > NEGLIGIBLE
    )
    return replace(best.fit, rivals=rivals)


def resolved(of: RationalModel, lines: Lines) -> bool:
    """Whether every resonance inside the band is as wide as the spacing of the lines."""
    spacing = float(np.median(np.diff(lines.frequency)))
    oscillatory = of.poles[np.abs(of.poles.imag) > np.abs(of.poles.real)]
    inside = np.abs(oscillatory) <= 2 * np.pi * lines.frequency[-1]
    return bool(np.all(2 * np.abs(oscillatory.real[inside]) >= 2 * np.pi * spacing))


def ranked(rows: list[Row[Fit]]) -> OrderChoice[Fit]:
    """Sort rows by AIC and add the difference to the least."""
    least = min(row.criteria.aic for row in rows)
    placed = [Row(row.order, row.fit, row.criteria, (row.criteria.aic - least) / 2) for row in rows]
    return OrderChoice(tuple(sorted(placed, key=lambda row: row.nats)))


def of_likelihood(chi_square: float, parameters: int, samples: int) -> Criteria:
    """Criteria where the variances are known: chi_square is -2 ln likelihood but for a constant."""
    return Criteria(
        _fpe(chi_square / samples, parameters, samples),
        chi_square + 2 * parameters,
        chi_square + parameters * float(np.log(samples)),
    )


def of_residuals(cost: float, parameters: int, samples: int) -> Criteria:
    """Criteria where the variance is that of the residuals. cost: sum of squares."""
    spread = samples * float(np.log(max(cost, 1e-300) / samples))
    return Criteria(
        _fpe(cost / samples, parameters, samples),
        spread + 2 * parameters,
        spread + parameters * float(np.log(samples)),
    )


def _fpe(cost: float, parameters: int, samples: int) -> float:
    if samples <= parameters:
        return float("inf")
    return cost * (samples + parameters) / (samples - parameters)

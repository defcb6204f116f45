"""The cost of a fit against the dead time that it is given: the delay that a recording identifies.

    profile = delay_profile(choose_order(lines, all_pole()))
    profile.delay, profile.low, profile.high       # s, 95 % interval

A zero in the right half plane acts like a delay: (1 - s d/2) / (1 + s d/2) is nearly e^(-s d).
So "the" delay is the one beside which the remainder is minimum phase; other points of the profile
are kept for the figure, not for the interval. The delay is that of the order of least description
length, which finds a finite order ever more surely where AIC keeps a sixth of the needless poles
(Schwarz 1978), and each needless pole takes up a part of the delay. The interval is where the best
of the orders within two nats loses less than 1.92 nats, its parameters counted: it includes the
uncertainty of the order too (profile likelihood, Wilks 1938).

A pair of zeros in the left half plane is confounded with delay too, so the candidate orders
matter: `model_order.all_pole` are those of a chain of lags and springs without a path around it, as
from throttle or spark to slip. A pole well above the band is indistinguishable from delay: where
the filling time of the intake is known, remove it first (`independent_lines.without`). A lag that
is removed with an error of 1 ms moves the delay by 1 ms: its uncertainty adds to the delay's.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.models.model_order import NATS, OrderChoice, Row
from slipbench.identification.models.rational_ml import ACROSS, RationalFit, latest, refit
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.response.response import ComplexArray
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

DROP = float(stats.chi2.ppf(0.95, 1)) / 2  # nats
POINTS = 31
FELT = np.radians(1.0)  # phase at the top of the band below which a zero is not identifiable


@dataclass(frozen=True)
class OrderProfile:
    """One order over the grid.

    cost           (m,) chi-square
    minimum_phase  (m,) whether the remainder has no identifiable zero in the right half plane
    penalty        nats for the parameters
    """

    order: Order
    cost: FloatArray
    minimum_phase: BoolArray
    penalty: float


@dataclass(frozen=True)
class DelayProfile:
    """Cost against delay.

    grid       (m,) s; profiles: one an order, the best by AIC first
    envelope   (m,) nats above the least, over orders and minimum-phase fits; inf where none is
    delay      s, of the order of least description length
    low, high  s, ends of the 95 % interval
    order      of least description length, whose delay it is
    """

    grid: FloatArray
    profiles: tuple[OrderProfile, ...]
    envelope: FloatArray
    delay: float
    low: float
    high: float
    order: Order


@dataclass(frozen=True)
class NoDelay:
    """Why no delay is given."""

    reason: str


def delay_profile(
    choice: OrderChoice[RationalFit], nats: float = NATS, points: int = POINTS, doubt: float = 0.0
) -> DelayProfile | NoDelay:
    """Profile the delay over every order within `nats` of the best, and the shortest to report.

    doubt: s, standard deviation of the lags that were removed beforehand (`KnownPath.doubt`).
    """
    rows, short = choice.within(nats), choice.best_by_mdl
    rows = rows if short in rows else (*rows, short)
    grid = _grid(rows, points)
    profiles = tuple(_profile(row.fit, grid) for row in rows)
    lines = rows[0].fit.lines
    misfit = max(1.0, min(row.fit.chi_square_ratio for row in rows))
    scale = 2 * lines.inflation * misfit
    each = [np.where(p.minimum_phase, p.cost / scale + p.penalty, np.inf) for p in profiles]
    envelope = np.min(each, axis=0)
    if not np.isfinite(envelope).any():
        return NoDelay("no order within 2 nats of the best is minimum phase beside any delay")
    envelope = envelope - envelope.min()
    low, high = _interval(grid, envelope)
    own = each[rows.index(short)]
    delay = float(grid[np.argmin(own if np.isfinite(own).any() else envelope)])
    return DelayProfile(
        grid,
        profiles,
        envelope,
        delay,
        max(delay - float(np.hypot(max(delay - low, 0.0), ACROSS * doubt)), 0.0),
        delay + float(np.hypot(max(high - delay, 0.0), ACROSS * doubt)),
        short.order,
    )


def felt_right_zeros(of: RationalModel, top: float) -> ComplexArray:
    """Zeros in the right half plane that turn the phase by a degree or more up to `top` Hz."""
    zeros = of.right_zeros
    return np.asarray(zeros[np.abs(zeros) < 2 * np.pi * top / np.tan(FELT)])


def _grid(rows: tuple[Row[RationalFit], ...], points: int) -> FloatArray:
    """Even steps, and closer ones about the delay of every fit."""
    longest = max(row.fit.model.delay for row in rows)
    most = min(1.5 * longest + 5e-3, 1.1 * latest(rows[0].fit.lines))
    near = [
        row.fit.model.delay + k * min(row.fit.delay_deviation, most / 20)
        for row in rows
        for k in (-3, -2, -1, -0.5, 0, 0.5, 1, 2, 3)
    ]
    grid = np.unique(np.round(np.concatenate((np.linspace(0, most, points), near)), 7))
    return np.asarray(grid[(grid >= 0) & (grid <= most)])


def _profile(fit: RationalFit, grid: FloatArray) -> OrderProfile:
    """Walk both ways from the fit's own delay, each point starting where the last one ended."""
    middle = int(np.searchsorted(grid, fit.model.delay - 1e-7))
    found: dict[int, RationalFit] = {}
    for way in (range(middle, grid.size), range(min(middle, grid.size) - 1, -1, -1)):
        at = fit
        for k in way:
            at = found[k] = refit(at, float(grid[k]))
    top = float(fit.lines.frequency[-1])
    walked = [found[k] for k in range(grid.size)]
    return OrderProfile(
        fit.order,
        np.array([f.chi_square for f in walked]),
        np.array([not felt_right_zeros(f.model, top).size for f in walked]),
        float(fit.order.size),
    )


def _interval(grid: FloatArray, envelope: FloatArray) -> tuple[float, float]:
    """Ends of the region in which the envelope stays below the drop; straight between points."""
    inside = np.flatnonzero(envelope <= DROP)
    first, last = int(inside[0]), int(inside[-1])
    low = _crossing(grid, envelope, first, first - 1) if first > 0 else float(grid[0])
    high = _crossing(grid, envelope, last, last + 1) if last < grid.size - 1 else float(grid[-1])
    return low, high


def _crossing(grid: FloatArray, envelope: FloatArray, inside: int, outside: int) -> float:
    if not np.isfinite(envelope[outside]):
        return float(grid[outside])
    share = (DROP - envelope[inside]) / (envelope[outside] - envelope[inside])
    return float(grid[inside] + share * (grid[outside] - grid[inside]))

"""A rational function with delay by maximum likelihood, with its uncertainty.

    lines = independent_lines(response)
    fit = fit_order(lines, Order(poles=3, zeros=0))
    fit.model, fit.chi_square_ratio, fit.modes, fit.response(frequency), fit.band(frequency)

Slow dynamics below the band, such as the speed's drift, act there as one factor: (s + z) / (s + p)
with z, p far below the lowest line is 1 + drift / s, drift = z - p. It is fitted jointly and
kept out of the model: if omitted it moves a resonance by tenths of a percent (0.12 % for a pole at
0.17 1/s under lines from 0.8 Hz), which is more than the uncertainty of a quiet recording.

Starts from Sanathanan and Koerner over several delays; then damped Gauss-Newton on
sum |G_i - G(f_i)|^2 / (deviation_i^2 / 2), which for complex normal errors is chi-square with
2 n - p degrees of freedom (Pintelon and Schoukens, System Identification: A Frequency Domain
Approach, 2nd ed., chapters 9 and 12). The parametrisation is stable; delays are not negative.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

from slipbench.identification.models.gauss_newton import MOST_STEPS, Minimum, minimise
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.sanathanan_koerner import first_guess
from slipbench.identification.models.serial_correlation import serial_covariance
from slipbench.identification.models.stable_rational import GREATEST, LEAST, Order, evaluate, model
from slipbench.identification.response.independent_lines import Lines
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

STARTS = (0.0, 0.3, 0.5, 0.7, 0.9)  # of the delay that the phase leaves room for
REFIT_STEPS = 20
SHORT, FAVOURITES = 12, 2  # steps from every start; so many of them then go on to the end
SLOW = 0.5  # of the lowest line: what drifts faster is no drift
CONFIDENCE = 0.95
ACROSS = float(stats.norm.ppf((1 + CONFIDENCE) / 2))
HALVINGS = 40  # of an interval, until its end is known


@dataclass(frozen=True)
class Mode:
    """A pole (damping 1) or a pair of poles, with standard deviations.

    frequency  Hz, natural; damping  1, above 1 where the pair is real
    """

    frequency: float
    damping: float
    frequency_deviation: float
    damping_deviation: float

    @property
    def single(self) -> bool:
        """A real pole, whose damping is no finding, from a pair."""
        return self.damping_deviation == 0


@dataclass(frozen=True)
class RationalFit:
    """A fitted rational function.

    x, covariance  parameters of `stable_rational` and then the drift, in the time unit 1 / pace
                   (rad/s), (p,), (p, p); rows of what was held or rests on a bound are zero
    chi_square     sum of squared errors over their variances
    freedom        real degrees of freedom: two a line, less the free parameters
    rivals         (weight, fit) of other orders that might be the true one; the weights and this
                   fit's own are 1 together. Bands and modes include the uncertainty of the order
    """

    order: Order
    lines: Lines
    x: FloatArray
    covariance: FloatArray
    pace: float
    chi_square: float
    freedom: int
    rivals: tuple[tuple[float, "RationalFit"], ...] = ()

    @property
    def model(self) -> RationalModel:
        """The function itself, in rad/s, without what drifts below the band."""
        return model(self.x[:-1], self.order, self.pace, (self.lines.input, self.lines.output))

    @property
    def chi_square_ratio(self) -> float:
        """Chi-square per degree of freedom, 1 where only noise is left."""
        return self.chi_square / max(self.freedom, 1) / self.lines.inflation

    @property
    def adequate(self) -> float:
        """Probability of so large a chi-square if the model is right."""
        return float(stats.chi2.sf(self.chi_square / self.lines.inflation, max(self.freedom, 1)))

    @property
    def delay_deviation(self) -> float:
        """Standard deviation of the delay within this order, s; 0 where it was held."""
        return float(np.sqrt(self.covariance[0, 0])) / self.pace

    @property
    def drift(self) -> tuple[float, float]:
        """Zero less pole of the slow dynamics below the band, and its standard deviation, rad/s."""
        return float(self.x[-1]) * self.pace, float(np.sqrt(self.covariance[-1, -1])) * self.pace

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Natural frequencies and dampings, in the order of the parameters."""
        pairs = [_pair(self, i) for i in range(1, self.order.poles, 2)]
        own = pairs + ([_single(self)] if self.order.poles % 2 else [])
        others = [(weight, rival.modes) for weight, rival in self.rivals]
        return tuple(_doubted(mode, others) for mode in own)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Expected measurement at `frequency` (Hz, in the band), drift included."""
        return drifting(self.x, _laplace(frequency, self.pace), self.order)[0]

    def band(self, frequency: FloatArray) -> FloatArray:
        """Half width of the 95 % band of the response's gain, (n,), output per input."""
        G, slopes = drifting(self.x, _laplace(frequency, self.pace), self.order)
        along = np.real(slopes * (np.conj(G) / np.abs(G))[:, None])
        own = ACROSS * np.sqrt(_quadratic(along, self.covariance))
        others = [
            (w, r.band(frequency), np.abs(r.response(frequency)) - np.abs(G))
            for w, r in self.rivals
        ]
        return mixed(own, others)

    def phase_band(self, frequency: FloatArray) -> FloatArray:
        """Half width of the 95 % band of the phase, rad, (n,)."""
        G, slopes = drifting(self.x, _laplace(frequency, self.pace), self.order)
        own = ACROSS * np.sqrt(_quadratic(np.imag(slopes / G[:, None]), self.covariance))
        others = [
            (w, r.phase_band(frequency), np.angle(r.response(frequency) / G))
            for w, r in self.rivals
        ]
        return mixed(own, others)


def fit_order(lines: Lines, order: Order, delay: float | None = None) -> RationalFit:
    """Fit one order; `delay` (s) holds the delay where it is known."""
    pace = pace_of(lines)
    held = None if delay is None else delay * pace
    low, high = _bounds(order, latest(lines) * pace, held, lines)
    delays = [share * latest(lines) for share in STARTS] if delay is None else [delay]
    s, weight = _normal(lines, pace)
    guesses = [first_guess(s, lines.value, weight, order, d * pace) for d in delays]
    starts = [np.append(guess, 0.0) for guess in guesses]
    begun = [_search(lines, order, pace, start, low, high, SHORT) for start in starts]
    ahead = sorted(begun, key=lambda m: m.cost)[:FAVOURITES]
    found = [_search(lines, order, pace, one.x, low, high) for one in ahead]
    return fitted(lines, order, min(found, key=lambda m: m.cost), low, high)


def refit(of: RationalFit, delay: float) -> RationalFit:
    """Fit the same order with another delay (s), from where `of` ended."""
    low, high = _bounds(of.order, 0.0, delay * of.pace, of.lines)
    at = _search(of.lines, of.order, of.pace, of.x, low, high, REFIT_STEPS)
    return fitted(of.lines, of.order, at, low, high)


def fitted(
    lines: Lines, order: Order, at: Minimum, low: FloatArray, high: FloatArray
) -> RationalFit:
    """Fit with its covariance: widened by residuals beyond the deviations and by their serial correlation.

    Residuals below the deviations narrow it as far as the bound on the accuracy of the lines is what
    made the deviations large.

    low, high: bounds of the parameters, shape (p,). A parameter at its bound has no variance.
    """
    moves = (at.x > low) & (at.x < high)
    freedom = 2 * lines.frequency.size - int(np.count_nonzero(moves))
    fit = RationalFit(
        order, lines, at.x, np.zeros((at.x.size, at.x.size)), pace_of(lines), at.cost, freedom
    )
    J = at.jacobian[:, moves]
    size = np.sqrt(np.sum(J**2, axis=0)) + 1e-300
    inner = np.linalg.pinv((J / size).T @ (J / size), rcond=1e-13) / np.outer(size, size)
    s, weight = _normal(lines, fit.pace)
    value, slopes = drifting(at.x, s, order)
    white = lines.inflation * max(fit.chi_square_ratio, lines.measured_share)
    fit.covariance[np.ix_(moves, moves)] = serial_covariance(
        value,
        (value - lines.value) * weight,
        slopes[:, moves] * weight[:, None],
        inner,
        weight,
        white,
        lines.serial,
    )
    above = at.x[1 + order.poles : -1] * lines.common  # all lines may be high or low together
    fit.covariance[1 + order.poles : -1, 1 + order.poles : -1] += np.outer(above, above)
    return fit


def drifting(x: FloatArray, s: ComplexArray, order: Order) -> tuple[ComplexArray, ComplexArray]:
    """G (n,) behind what drifts, and its derivatives (n, p). x: of `evaluate`, then drift."""
    R, slopes = evaluate(x[:-1], s, order)
    slow = 1 + x[-1] / s
    return R * slow, np.column_stack((slopes * slow[:, None], R / s))


def latest(lines: Lines) -> float:
    """Longest delay that the phase leaves room for, s: all of it a delay, over the upper half."""
    phase = np.unwrap(np.angle(lines.value))
    upper = slice(lines.frequency.size // 2, None)
    phase = phase - 2 * np.pi * np.round(phase[0] / (2 * np.pi))
    return float(max(np.max(-phase[upper] / (2 * np.pi * lines.frequency[upper])), 2e-3))


def pace_of(lines: Lines) -> float:
    """Unit of frequency in which the band is about 1, rad/s."""
    return float(2 * np.pi * lines.frequency[-1] / 1.5)


def _normal(lines: Lines, pace: float) -> tuple[ComplexArray, FloatArray]:
    return _laplace(lines.frequency, pace), np.asarray(np.sqrt(2) / lines.deviation)


def _laplace(frequency: FloatArray, pace: float) -> ComplexArray:
    return np.asarray(2j * np.pi * np.asarray(frequency) / pace, dtype=np.complex128)


def _search(
    lines: Lines,
    order: Order,
    pace: float,
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    most: int = MOST_STEPS,
) -> Minimum:
    s, weight = _normal(lines, pace)

    def residuals(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        G, slopes = drifting(x, s, order)
        error, slope = (G - lines.value) * weight, slopes * weight[:, None]
        return np.concatenate((error.real, error.imag)), np.vstack((slope.real, slope.imag))

    return minimise(residuals, start, low, high, most)


def _bounds(
    order: Order, most: float, held: float | None, lines: Lines
) -> tuple[FloatArray, FloatArray]:
    free = np.full(order.zeros + 1, np.inf)
    shut = np.ones(order.poles)
    delay = (0.0, 1.5 * most) if held is None else (held, held)
    slow = SLOW * 2 * np.pi * lines.frequency[0] / pace_of(lines)
    low = np.concatenate(([delay[0]], LEAST * shut, -free, [-slow]))
    return low, np.concatenate(([delay[1]], GREATEST * shut, free, [slow]))


def _pair(fit: RationalFit, i: int) -> Mode:
    a, c = np.exp(fit.x[i]), np.exp(fit.x[i + 1])
    frequency, damping = fit.pace / np.sqrt(c) / (2 * np.pi), a / (2 * np.sqrt(c))
    C = fit.covariance[i : i + 2, i : i + 2]
    spread = np.sqrt(max(C[0, 0] - C[0, 1] + C[1, 1] / 4, 0.0))
    return Mode(
        float(frequency),
        float(damping),
        float(frequency * np.sqrt(C[1, 1]) / 2),
        float(damping * spread),
    )


def _single(fit: RationalFit) -> Mode:
    n = fit.order.poles
    frequency = float(fit.pace / np.exp(fit.x[n]) / (2 * np.pi))
    return Mode(frequency, 1.0, frequency * float(np.sqrt(fit.covariance[n, n])), 0.0)


def mixed(own: FloatArray, others: list[tuple[float, FloatArray, FloatArray]]) -> FloatArray:
    """Half width, (n,), of 95 % with model uncertainty.

    own: (n,) half width of this model; others: weight (1), half width (n,) and distance (n,) of each
    other one. The estimate is distributed as a mixture of normal distributions, and the half width is
    that within which 95 % of the mixture lie. (The variance of the mixture, Burnham and Anderson, section
    4.3.2, would let an order of small weight and wide interval widen it far beyond that.)
    """
    if not others:
        return own
    weights = np.array([1 - sum(w for w, *_ in others), *(w for w, *_ in others)])
    widths = np.stack([own, *(half for _, half, _ in others)])
    apart = np.stack([np.zeros_like(own), *(np.abs(d) for *_, d in others)])
    deviation = np.maximum(widths / ACROSS, 1e-300)
    low, high = np.zeros_like(own), np.max(apart + 2 * widths, axis=0)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        inside = special.ndtr((middle - apart) / deviation) - special.ndtr(
            (-middle - apart) / deviation
        )
        enough = weights @ inside >= CONFIDENCE
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high)


def _doubted(mode: Mode, others: list[tuple[float, tuple[Mode, ...]]]) -> Mode:
    """Widen a mode's deviations by the same mode in other orders, where they have it."""
    same = []
    for weight, modes in others:
        same_kind = [m for m in modes if m.single == mode.single]
        if same_kind:
            nearest = min(same_kind, key=lambda m: abs(np.log(m.frequency / mode.frequency)))
            same.append((weight, nearest))
    frequency = _deviation(
        mode.frequency_deviation,
        [(w, m.frequency_deviation, m.frequency - mode.frequency) for w, m in same],
    )
    if mode.single:
        return replace(mode, frequency_deviation=frequency)
    damping = _deviation(
        mode.damping_deviation,
        [(w, m.damping_deviation, m.damping - mode.damping) for w, m in same],
    )
    return replace(mode, frequency_deviation=frequency, damping_deviation=damping)


def _deviation(own: float, others: list[tuple[float, float, float]]) -> float:
    """Deviation whose 95 % interval is that of a mixture. others: weight, deviation, distance."""
    each = [(w, np.array([ACROSS * s]), np.array([d])) for w, s, d in others]
    return float(mixed(np.array([ACROSS * own]), each)[0]) / ACROSS


def _quadratic(rows: FloatArray, covariance: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.einsum("ij,jk,ik->i", rows, covariance, rows), 0.0))

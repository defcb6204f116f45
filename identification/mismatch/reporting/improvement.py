"""Held-out improvement by the accepted effects, against the re-calibrated system.

The reference is not the nominal system, since calibration alone reduces most errors. Both systems
are simulated on the held-out recordings with the parameters of the training recordings:

- log-likelihood: each system with the noise model fitted to its own held-out residuals (nats);
- simulation error: root mean square of measured minus simulated, without feedback of measurements;
- error in the band: the same, in the band in which the two systems differ beyond the noise;
- one-step error: root mean square of the innovations, given the previous residuals.

Intervals: 95 %, delete-one jackknife over pieces of time with Student's t (Efron and Tibshirani,
"An Introduction to the Bootstrap" (1993), chapter 11). They hold for these recordings.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.plant.signals import Floats

CONFIDENCE = 0.95
MIDDLE = 0.8
"""Fraction of the power of the difference that a band contains."""
FEWEST = 4
"""Minimum number of pieces of time for an interval."""
RELEVANT_CHANGE = 0.01
"""Smallest relevant relative change of an error."""
NOT_KNOWN = (0.0, float("inf"))


@dataclass(frozen=True)
class Change:
    """An error before and after, in the output's unit. interval: of after over before."""

    calibrated: float
    improved: float
    interval: tuple[float, float]

    @property
    def falls(self) -> bool:
        """Whether the decrease of the error is significant and relevant."""
        smaller = self.improved < (1.0 - RELEVANT_CHANGE) * self.calibrated
        return smaller and self.interval[1] < 1.0

    @property
    def rises(self) -> bool:
        """Whether the increase of the error is significant and relevant."""
        larger = self.improved > (1.0 + RELEVANT_CHANGE) * self.calibrated
        return larger and self.interval[0] > 1.0


@dataclass(frozen=True)
class OutputImprovement:
    """Errors of one output. band: Hz; None where rows are no time series, as in a tooth pattern.

    share: fraction that the output has of the squared difference of the systems over its noise.
    """

    output: str
    unit: str
    share: float
    simulation: Change
    one_step: Change
    band: tuple[float, float] | None = None
    in_band: Change | None = None


@dataclass(frozen=True)
class Improvement:
    """Held-out improvement. log_likelihood_gain: nats; interval: its 95 %."""

    log_likelihood_gain: float
    interval: tuple[float, float]
    outputs: tuple[OutputImprovement, ...]

    def of(self, output: str) -> OutputImprovement | None:
        """Return the improvement of an output."""
        return next((o for o in self.outputs if o.output == output), None)

    @property
    def differs_most(self) -> OutputImprovement:
        """Output in which the two systems differ most relative to its noise."""
        return max(self.outputs, key=lambda o: o.share)


def improvement(before: Fit, after: Fit) -> Improvement:
    """Compare the re-calibrated system with the improved one.

    before, after: the two systems on the held-out recordings.
    """
    gains = _sums_by_piece(after, log_density) - _sums_by_piece(before, log_density)
    groups = range(len(before.model.partition.groups))
    outputs = [o for b in groups for o in _outputs(before, after, b)]
    total = sum(o.share for o in outputs) or 1.0
    return Improvement(
        float(gains.sum()),
        _interval_of_sum(gains),
        tuple(replace(o, share=o.share / total) for o in outputs),
    )


def log_density(run: Fit, b: int, r: int) -> Floats:
    """Return the log-density of each row given the previous rows, (T,), nats up to a constant."""
    return run.noise[b].log_densities(run.residuals[b][r])


def _innovations_in_units(noise: Whitener, series: Floats) -> Floats:
    return np.asarray(noise.innovations(series) @ np.linalg.inv(noise.inverse).T)


def _split_into_pieces(run: Fit, r: int, rows: Floats, length: int) -> list[Floats]:
    """Return rows by piece of time; `rows` lacks the first rows that the noise model uses."""
    count = run.model.records[r].grid.pieces
    piece_of_row = np.minimum((np.arange(length) * count) // length, count - 1)[
        length - len(rows) :
    ]
    return [rows[piece_of_row == piece] for piece in range(count)]


def _sums_by_piece(run: Fit, quantity: Callable[[Fit, int, int], Floats]) -> Floats:
    """Return sums of a quantity over all outputs by piece of time of all records, (pieces,)."""
    sums = []
    for r in range(len(run.model.records)):
        groups = range(len(run.model.partition.groups))
        parts = [
            _split_into_pieces(run, r, quantity(run, b, r), len(run.residuals[b][r]))
            for b in groups
        ]
        sums += [
            sum(float(p.sum()) for p in outputs_of_piece)
            for outputs_of_piece in zip(*parts, strict=True)
        ]
    return np.array(sums)


def _outputs(before: Fit, after: Fit, b: int) -> Iterator[OutputImprovement]:
    """Yield the improvement of every output of a group; shares are not normalized."""
    records, group = before.model.records, before.model.partition.groups[b]
    residuals = [before.residuals[b], after.residuals[b]]
    difference = [
        _innovations_in_units(after.noise[b], one - two)
        for one, two in zip(*residuals, strict=True)
    ]
    innovations = [
        [_innovations_in_units(run.noise[b], one) for one in run.residuals[b]]
        for run in (before, after)
    ]
    spread = np.sqrt(np.diag(np.linalg.inv(after.noise[b].inverse.T @ after.noise[b].inverse)))
    for j, output in enumerate(group.outputs):
        band = (
            _band([one[:, j] for one in difference], records[0].grid.width) if group.order else None
        )
        filtered = [[within(r[:, j], band, records[0].grid.width) for r in rs] for rs in residuals]
        yield OutputImprovement(
            output,
            records[0].sensors[output].unit,
            sum(float(np.sum(one[:, j] ** 2)) for one in difference) / float(spread[j]) ** 2,
            _change(before, b, *([r[:, j] for r in rs] for rs in residuals)),
            _change(before, b, *([r[:, j] for r in rs] for rs in innovations)),
            band,
            _change(before, b, *filtered) if band else None,
        )


def _change(run: Fit, b: int, before: list[Floats], after: list[Floats]) -> Change:
    """Return root mean square errors and their ratio. before, after: (T,) by record."""
    sums: list[list[tuple[float, int]]] = [[], []]
    for destination, series in zip(sums, (before, after), strict=True):
        for r, one in enumerate(series):
            pieces = _split_into_pieces(run, r, one, len(run.residuals[b][r]))
            destination += [(float(np.sum(p**2)), p.size) for p in pieces if p.size]
    (one, n), (two, m) = (np.array(s).T for s in sums)
    calibrated, improved = np.sqrt(one.sum() / n.sum()), np.sqrt(two.sum() / m.sum())
    return Change(float(calibrated), float(improved), interval_of_ratio(one, two))


def _interval_of_sum(gains: Floats) -> tuple[float, float]:
    if gains.size < FEWEST:
        return -NOT_KNOWN[1], NOT_KNOWN[1]
    half_width = _t_quantile(gains.size) * float(gains.std(ddof=1)) * gains.size**0.5
    return float(gains.sum()) - half_width, float(gains.sum()) + half_width


def interval_of_ratio(before: Floats, after: Floats) -> tuple[float, float]:
    """Return the 95 % interval of the RMS error ratio.

    before, after: sums of squares by piece of time, shape (pieces,). NOT_KNOWN where there are
    fewer than FEWEST pieces, or a sum over all pieces is 0.
    """
    n = before.size
    if n < FEWEST or not (before.sum() > 0.0 and after.sum() > 0.0):
        return NOT_KNOWN
    log_ratio = 0.5 * np.log(after.sum() / before.sum())
    log_ratios_without_piece = 0.5 * np.log(
        (after.sum() - after) / np.maximum(before.sum() - before, 1e-300)
    )
    half_width = _t_quantile(n) * np.sqrt(
        (n - 1) / n * np.sum((log_ratios_without_piece - log_ratios_without_piece.mean()) ** 2)
    )
    return float(np.exp(log_ratio - half_width)), float(np.exp(log_ratio + half_width))


def _t_quantile(pieces: int) -> float:
    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, pieces - 1))


def _band(series: Sequence[Floats], width: float) -> tuple[float, float]:
    """Return the band of the central MIDDLE of the power of all records, Hz. width: of a bin, s."""
    length = min(one.size for one in series)
    power = sum(np.abs(np.fft.rfft(one[:length])) ** 2 for one in series)
    frequency = np.fft.rfftfreq(length, width)
    share = np.cumsum(power) / max(float(np.sum(power)), 1e-300)
    quantiles = (0.5 - MIDDLE / 2, 0.5 + MIDDLE / 2)
    low, high = (
        frequency[min(int(np.searchsorted(share, e)), frequency.size - 1)] for e in quantiles
    )
    return float(low), float(high)


def within(series: Floats, band: tuple[float, float] | None, width: float) -> Floats:
    """Return a series filtered to a band. band: Hz; None: unfiltered; width: of a bin, s."""
    if band is None:
        return series
    spectrum = np.fft.rfft(series)
    frequency = np.fft.rfftfreq(series.size, width)
    spectrum[(frequency < band[0]) | (frequency > band[1])] = 0.0
    return np.fft.irfft(spectrum, series.size)

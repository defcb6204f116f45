"""Improvement by what was found, on held-out recordings, against the re-calibrated file.

Calibration alone makes most errors smaller, so the nominal file is no measure of an effect. Both
systems meet the held-out recordings with the numbers of the training recordings:

- log-likelihood: each system with the noise model that its own held-out residuals give (nats);
- simulation error: root mean square of measured less simulated, nothing fed back;
- error in the band: the same, in the band in which the two systems differ beyond the noise;
- one-step error: what is new in each bin, given the residuals before it.

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
"""Share of the evidence that a band holds."""
FEWEST = 4
"""Pieces of time below which no interval is told."""
WORTH_TELLING = 0.01
"""Share of an error that must go for a user to care."""
NOT_KNOWN = (0.0, float("inf"))


@dataclass(frozen=True)
class Change:
    """An error before and after, in the output's unit. interval: of after over before."""

    calibrated: float
    improved: float
    interval: tuple[float, float]

    @property
    def falls(self) -> bool:
        """Whether the error falls certainly, and by as much as a user cares about."""
        smaller = self.improved < (1.0 - WORTH_TELLING) * self.calibrated
        return smaller and self.interval[1] < 1.0

    @property
    def rises(self) -> bool:
        """Whether the error rises certainly, and by as much as a user cares about."""
        larger = self.improved > (1.0 + WORTH_TELLING) * self.calibrated
        return larger and self.interval[0] > 1.0


@dataclass(frozen=True)
class OutputImprovement:
    """Errors of one output. band: Hz; None where rows are no time series, as of a tooth pattern.

    share: of the difference between the two systems beyond the noise, by output.
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
        """The output in which the two systems differ most, against its noise."""
        return max(self.outputs, key=lambda o: o.share)


def improvement(before: Fit, after: Fit) -> Improvement:
    """Compare the re-calibrated system with the one that has what was found.

    before, after: the two of them on the held-out recordings.
    """
    gains = _by_piece(after, log_density) - _by_piece(before, log_density)
    blocks = range(len(before.model.partition.groups))
    found = [o for b in blocks for o in _outputs(before, after, b)]
    whole = sum(o.share for o in found) or 1.0
    return Improvement(
        float(gains.sum()),
        _interval_of_sum(gains),
        tuple(replace(o, share=o.share / whole) for o in found),
    )


def log_density(run: Fit, b: int, r: int) -> Floats:
    """Log-density of every row of a block given the rows before, (T,), nats up to a constant."""
    return run.noise[b].log_densities(run.residuals[b][r])


def _unscaled(noise: Whitener, series: Floats) -> Floats:
    return np.asarray(noise.innovations(series) @ np.linalg.inv(noise.inverse).T)


def _pieces(run: Fit, r: int, rows: Floats, length: int) -> list[Floats]:
    """Rows by piece of time; rows that the noise model takes at the beginning are missing."""
    count = run.model.records[r].grid.pieces
    number = np.minimum((np.arange(length) * count) // length, count - 1)[length - len(rows) :]
    return [rows[number == piece] for piece in range(count)]


def _by_piece(run: Fit, of: Callable[[Fit, int, int], Floats]) -> Floats:
    """Sums over the pieces of all records, outputs together, (pieces,)."""
    found = []
    for r in range(len(run.model.records)):
        blocks = range(len(run.model.partition.groups))
        parts = [_pieces(run, r, of(run, b, r), len(run.residuals[b][r])) for b in blocks]
        found += [sum(float(p.sum()) for p in piece) for piece in zip(*parts, strict=True)]
    return np.array(found)


def _outputs(before: Fit, after: Fit, b: int) -> Iterator[OutputImprovement]:
    """Improvement of every output of a block; shares are not yet shares of a whole."""
    records, block = before.model.records, before.model.partition.groups[b]
    rest = [before.residuals[b], after.residuals[b]]
    apart = [_unscaled(after.noise[b], one - two) for one, two in zip(*rest, strict=True)]
    new = [[_unscaled(run.noise[b], one) for one in run.residuals[b]] for run in (before, after)]
    spread = np.sqrt(np.diag(np.linalg.inv(after.noise[b].inverse.T @ after.noise[b].inverse)))
    for j, output in enumerate(block.outputs):
        band = _band([one[:, j] for one in apart], records[0].grid.width) if block.order else None
        kept = [[within(r[:, j], band, records[0].grid.width) for r in rs] for rs in rest]
        yield OutputImprovement(
            output,
            records[0].sensors[output].unit,
            sum(float(np.sum(one[:, j] ** 2)) for one in apart) / float(spread[j]) ** 2,
            _change(before, b, *([r[:, j] for r in rs] for rs in rest)),
            _change(before, b, *([r[:, j] for r in rs] for rs in new)),
            band,
            _change(before, b, *kept) if band else None,
        )


def _change(run: Fit, b: int, before: list[Floats], after: list[Floats]) -> Change:
    """Root mean square errors and their ratio. before, after: (T,) by record."""
    sums: list[list[tuple[float, int]]] = [[], []]
    for into, series in zip(sums, (before, after), strict=True):
        for r, one in enumerate(series):
            parts = _pieces(run, r, one, len(run.residuals[b][r]))
            into += [(float(np.sum(p**2)), p.size) for p in parts if p.size]
    (one, n), (two, m) = (np.array(s).T for s in sums)
    calibrated, improved = np.sqrt(one.sum() / n.sum()), np.sqrt(two.sum() / m.sum())
    return Change(float(calibrated), float(improved), interval_of_ratio(one, two))


def _interval_of_sum(gains: Floats) -> tuple[float, float]:
    if gains.size < FEWEST:
        return -NOT_KNOWN[1], NOT_KNOWN[1]
    half = _quantile(gains.size) * float(gains.std(ddof=1)) * gains.size**0.5
    return float(gains.sum()) - half, float(gains.sum()) + half


def interval_of_ratio(before: Floats, after: Floats) -> tuple[float, float]:
    """Interval of the ratio of root mean squares. before, after: sums of squares by piece."""
    n = before.size
    if n < FEWEST or not (before.sum() > 0.0 and after.sum() > 0.0):
        return NOT_KNOWN
    whole = 0.5 * np.log(after.sum() / before.sum())
    without = 0.5 * np.log((after.sum() - after) / np.maximum(before.sum() - before, 1e-300))
    half = _quantile(n) * np.sqrt((n - 1) / n * np.sum((without - without.mean()) ** 2))
    return float(np.exp(whole - half)), float(np.exp(whole + half))


def _quantile(pieces: int) -> float:
    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, pieces - 1))


def _band(series: Sequence[Floats], width: float) -> tuple[float, float]:
    """Band that holds the middle of the power of series of all records, Hz. width: s, of a bin."""
    length = min(one.size for one in series)
    power = sum(np.abs(np.fft.rfft(one[:length])) ** 2 for one in series)
    grid = np.fft.rfftfreq(length, width)
    share = np.cumsum(power) / max(float(np.sum(power)), 1e-300)
    ends = (0.5 - MIDDLE / 2, 0.5 + MIDDLE / 2)
    low, high = (grid[min(int(np.searchsorted(share, e)), grid.size - 1)] for e in ends)
    return float(low), float(high)


def within(series: Floats, band: tuple[float, float] | None, width: float) -> Floats:
    """Part of a series within a band. band: Hz; None: all of it; width: s, of a bin."""
    if band is None:
        return series
    lines = np.fft.rfft(series)
    grid = np.fft.rfftfreq(series.size, width)
    lines[(grid < band[0]) | (grid > band[1])] = 0.0
    return np.fft.irfft(lines, series.size)

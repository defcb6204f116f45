"""Lower bound of the error: the part that repeated trials do not reproduce, and a lack-of-fit test.

Where a trial was repeated, half the mean square difference between the two residuals is what no
model of the commands can explain. Comparing the mean of the two residuals with it tests the model
without a noise model (lack of fit; Draper and Smith, Applied Regression Analysis, chapter 2).
Without repeated trials the floor is the standard deviation of the innovations of the noise model,
or the variation of a tooth pattern between time segments.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import stats

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.signals import Floats

REPEATED, INNOVATIONS, PATTERN = "repeated trials", "innovations", "pattern"
SAME = 0.15
"""Largest difference of two command waveforms of a repeated trial, in standard deviations of the
command."""


@dataclass(frozen=True)
class LackOfFit:
    """F: mean square of the common part of repeated trials over that of their difference.

    trials: names of the repeated recordings.
    """

    trials: tuple[tuple[str, str], ...]
    f: float
    p_value: float


def floors(fit: Fit, group: int) -> tuple[Floats, str]:
    """Return the error floor of every output of a group, (m,), in its unit, and its source."""
    pairs = list(repeated(fit.model.records))
    residuals = fit.residuals[group]
    if pairs:
        half_squares = [
            0.5 * (a - b) ** 2 for a, b in (_common(residuals[i], residuals[j]) for i, j in pairs)
        ]
        return np.sqrt(np.mean(np.concatenate(half_squares), axis=0)), REPEATED
    if fit.model.partition.groups[group].order:
        root = np.linalg.inv(fit.noise[group].inverse)
        return np.sqrt(np.sum(root**2, axis=1)), INNOVATIONS
    return _between_segments(fit, group), PATTERN


def lack_of_fit(fit: Fit) -> LackOfFit | None:
    """Test the lack of fit by repeated trials; None where no trial was repeated."""
    pairs = list(repeated(fit.model.records))
    common = difference = 0.0
    count = 0
    for i, j in pairs:
        for noise, residuals in zip(fit.noise, fit.residuals, strict=True):
            a, b = _common(noise(residuals[i]), noise(residuals[j]))
            common += float(np.sum((a + b) ** 2)) / 2.0
            difference += float(np.sum((a - b) ** 2)) / 2.0
            count += a.size
    if not count:
        return None
    f = common / max(difference, 1e-300)
    names = tuple((fit.model.records[i].name, fit.model.records[j].name) for i, j in pairs)
    return LackOfFit(names, f, float(stats.f.sf(f, count, count)))


def repeated(records: tuple[Record, ...]) -> Iterator[tuple[int, int]]:
    """Yield index pairs of recordings of the same trial; each recording is used once."""
    used: set[int] = set()
    for i, j in combinations(range(len(records)), 2):
        if not used & {i, j} and _same_commands(records[i].inputs, records[j].inputs):
            used |= {i, j}
            yield i, j


def _same_commands(a: Floats, b: Floats) -> bool:
    a, b = _common(a, b)
    known = np.isfinite(a).all(axis=0) & np.isfinite(b).all(axis=0)
    spread = np.maximum(a.std(axis=0), b.std(axis=0))
    moving = known & (spread > 0.0)
    difference = np.sqrt(np.mean((a - b) ** 2, axis=0))
    return bool(moving.any() and np.all(difference[moving] < SAME * spread[moving]))


def _common(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    length = min(len(a), len(b))
    return a[:length], b[:length]


def _between_segments(fit: Fit, group: int) -> Floats:
    """Standard deviation of a tooth pattern about its mean over the time segments, shape (1,).

    A residual holds one value per tooth, segment after segment; the number of segments follows from
    the number of teeth.
    """
    variance, freedom = 0.0, 0
    output = fit.model.partition.groups[group].outputs[0]
    for record, residuals in zip(fit.model.records, fit.residuals[group], strict=True):
        rows = residuals.reshape(-1, record.sensors[output].teeth)
        if len(rows) > 1:
            variance += float(np.sum((rows - rows.mean(axis=0)) ** 2))
            freedom += rows.size - rows.shape[1]
    total = float(np.mean(np.concatenate(fit.residuals[group]) ** 2))
    return np.array([np.sqrt(variance / freedom if freedom else total)])

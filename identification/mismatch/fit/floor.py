"""How small an error can be at all: what trials do not repeat, and whether a model lacks more.

Where a trial was repeated, half the mean square difference between the two residuals is what no
model of the commands can explain, and the mean of the two against it tests the model without any
model of the noise (lack of fit; Draper and Smith, Applied Regression Analysis, chapter 2).
Elsewhere the floor is what is new in every bin: the innovations of the noise model, or the
scatter of a tooth pattern from one stretch of time to the next.
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
"""Largest difference of two courses of a command, in their deviations, of a repeated trial."""


@dataclass(frozen=True)
class LackOfFit:
    """F: mean square of what repeated trials share over that in which they differ.

    trials: names of the repeated recordings.
    """

    trials: tuple[tuple[str, str], ...]
    f: float
    p_value: float


def floors(fit: Fit, block: int) -> tuple[Floats, str]:
    """Return the floor of every output of a block, in its unit, and what it is told by."""
    pairs = list(repeated(fit.model.records))
    rest = fit.residuals[block]
    if pairs:
        halves = [0.5 * (a - b) ** 2 for a, b in (_common(rest[i], rest[j]) for i, j in pairs)]
        return np.sqrt(np.mean(np.concatenate(halves), axis=0)), REPEATED
    if fit.model.partition.groups[block].order:
        root = np.linalg.inv(fit.noise[block].inverse)
        return np.sqrt(np.sum(root**2, axis=1)), INNOVATIONS
    return _between_segments(fit, block), PATTERN


def lack_of_fit(fit: Fit) -> LackOfFit | None:
    """Test a fit by its repeated trials; None where none was repeated."""
    pairs = list(repeated(fit.model.records))
    shared = different = 0.0
    count = 0
    for i, j in pairs:
        for white, rest in zip(fit.noise, fit.residuals, strict=True):
            a, b = _common(white(rest[i]), white(rest[j]))
            shared += float(np.sum((a + b) ** 2)) / 2.0
            different += float(np.sum((a - b) ** 2)) / 2.0
            count += a.size
    if not count:
        return None
    f = shared / max(different, 1e-300)
    names = tuple((fit.model.records[i].name, fit.model.records[j].name) for i, j in pairs)
    return LackOfFit(names, f, float(stats.f.sf(f, count, count)))


def repeated(records: tuple[Record, ...]) -> Iterator[tuple[int, int]]:
    """Yield pairs of recordings of one trial, each recording once."""
    taken: set[int] = set()
    for i, j in combinations(range(len(records)), 2):
        if not taken & {i, j} and _alike(records[i].inputs, records[j].inputs):
            taken |= {i, j}
            yield i, j


def _alike(a: Floats, b: Floats) -> bool:
    a, b = _common(a, b)
    known = np.isfinite(a).all(axis=0) & np.isfinite(b).all(axis=0)
    spread = np.maximum(a.std(axis=0), b.std(axis=0))
    moving = known & (spread > 0.0)
    apart = np.sqrt(np.mean((a - b) ** 2, axis=0))
    return bool(moving.any() and np.all(apart[moving] < SAME * spread[moving]))


def _common(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    length = min(len(a), len(b))
    return a[:length], b[:length]


def _between_segments(fit: Fit, block: int) -> Floats:
    """VarianceInflation of a tooth pattern about its mean over the segments of time, shape (1,).

    A residual holds one value a tooth, segment after segment; how many segments there are follows
    from the number of teeth.
    """
    variance, freedom = 0.0, 0
    output = fit.model.partition.groups[block].outputs[0]
    for record, rest in zip(fit.model.records, fit.residuals[block], strict=True):
        rows = rest.reshape(-1, record.sensors[output].teeth)
        if len(rows) > 1:
            variance += float(np.sum((rows - rows.mean(axis=0)) ** 2))
            freedom += rows.size - rows.shape[1]
    own = float(np.mean(np.concatenate(fit.residuals[block]) ** 2))
    return np.array([np.sqrt(variance / freedom if freedom else own)])

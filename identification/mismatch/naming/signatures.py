"""Score tests of effects by their signatures, and signatures of different directions.

A signature is the whitened change of all outputs that an effect brings.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import LARGEST
from slipbench.plant.signals import Floats

BATCH = 32
ALIKE = 0.8
"""Cosine above which two signatures count as one direction: the residual hardly tells them apart."""

Item = TypeVar("Item")


@dataclass(frozen=True)
class ScoreTests:
    """Of several signatures, (k,) each, with the nuisances projected out.

    hidden: nuisance coordinates that imitate them best, (p, k). whole, energy: sum of squares before
    and after the projection. amplitude: of least squares. log_likelihood_gain: nats. visible: whether anything remains.
    """

    hidden: Floats
    whole_energy: Floats
    energy: Floats
    amplitude: Floats
    log_likelihood_gain: Floats
    visible: npt.NDArray[np.bool_]


def score_tests(linear: Linearization, columns: Floats) -> ScoreTests:
    """Test signatures, (rows, k), against the residual."""
    whole = np.einsum("ij,ij->j", columns, columns)
    inside, hidden = linear.nuisances.products(columns)
    energy = whole - np.einsum("ij,ij->j", inside, hidden)
    push = columns.T @ linear.residuals[: len(columns)]
    seen = (energy > 1e-9 * np.maximum(whole, 1.0)) & (energy >= 1e-6)
    amplitude = np.where(seen, push, 0.0) / np.where(seen, energy, 1.0)
    gain = 0.5 * energy * np.maximum(amplitude, 0.0) ** 2
    return ScoreTests(hidden, whole, energy, amplitude, gain, seen)


def directions(linear: Linearization, columns: Floats) -> Floats:
    """Return signatures, (rows, k), with the nuisances projected out, each of length one or zero."""
    off = linear.nuisances.project_out(columns)
    length = np.sqrt(np.einsum("ij,ij->j", off, off))
    return np.asarray(off / np.where(length > 0.0, length, 1.0))


def different(directions: Floats, most: int) -> list[int]:
    """Return indices of the first signatures, (rows, k), that are unlike all before them."""
    found: list[int] = []
    for i, one in enumerate(directions.T):
        if len(found) < most and np.all(np.abs(directions[:, found].T @ one) < ALIKE):
            found.append(i)
    return found


def batches(linear: Linearization, tried: Sequence[Item]) -> Iterator[Sequence[Item]]:
    """Yield as many at a time as have room, signatures of all recordings each."""
    count = min(BATCH, max(LARGEST // len(linear.clusters), 1))
    for first in range(0, len(tried), count):
        yield tried[first : first + count]

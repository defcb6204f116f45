"""Score tests of effects by their responses, and responses of different directions.

An effect response is the whitened change of all outputs by an effect.
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
"""Cosine above which two responses count as one direction: the residual hardly distinguishes
them."""

Item = TypeVar("Item")


@dataclass(frozen=True)
class ScoreTests:
    """Score tests of several responses, (k,) each, with the nuisances projected out.

    hidden: nuisance coordinates that fit them best, (p, k). whole_energy, energy: sum of squares
    before and after the projection. amplitude: of least squares. log_likelihood_gain: nats.
    visible: whether the projected response is nonzero.
    """

    hidden: Floats
    whole_energy: Floats
    energy: Floats
    amplitude: Floats
    log_likelihood_gain: Floats
    visible: npt.NDArray[np.bool_]


def score_tests(linear: Linearization, columns: Floats) -> ScoreTests:
    """Test responses, shape (rows, k), against the residual."""
    whole_energy = np.einsum("ij,ij->j", columns, columns)
    products, hidden = linear.nuisances.products(columns)
    energy = whole_energy - np.einsum("ij,ij->j", products, hidden)
    correlation = columns.T @ linear.residuals[: len(columns)]
    visible = (energy > 1e-9 * np.maximum(whole_energy, 1.0)) & (energy >= 1e-6)
    amplitude = np.where(visible, correlation, 0.0) / np.where(visible, energy, 1.0)
    gain = 0.5 * energy * np.maximum(amplitude, 0.0) ** 2
    return ScoreTests(hidden, whole_energy, energy, amplitude, gain, visible)


def directions(linear: Linearization, columns: Floats) -> Floats:
    """Return projected responses of columns, each normalized to length one or zero.

    columns: shape (rows, k); gives shape (rows + p, k), see `Nuisances.project_out`.
    """
    projected = linear.nuisances.project_out(columns)
    length = np.sqrt(np.einsum("ij,ij->j", projected, projected))
    return np.asarray(projected / np.where(length > 0.0, length, 1.0))


def different(directions: Floats, most: int) -> list[int]:
    """Return indices of the first directions that differ from all before them.

    directions: see `directions`, shape (rows + p, k); most: largest number of indices.
    """
    selected: list[int] = []
    for i, one in enumerate(directions.T):
        if len(selected) < most and np.all(np.abs(directions[:, selected].T @ one) < ALIKE):
            selected.append(i)
    return selected


def batches(linear: Linearization, items: Sequence[Item]) -> Iterator[Sequence[Item]]:
    """Yield batches of items whose responses to all recordings fit into LARGEST elements."""
    count = min(BATCH, max(LARGEST // len(linear.clusters), 1))
    for first in range(0, len(items), count):
        yield items[first : first + count]

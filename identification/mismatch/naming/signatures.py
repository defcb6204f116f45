"""How signatures push what a fit leaves, and which of them push in different directions."""

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
"""Cosine of two signatures above which they push what is left in the same direction."""

Tries = TypeVar("Tries")


@dataclass(frozen=True)
class Pushed:
    """Of several signatures, (k,) each, off the nuisances.

    hidden: what hides them, (p, k). seen: whether anything is left of them.
    """

    hidden: Floats
    whole: Floats
    energy: Floats
    amplitude: Floats
    gain: Floats
    seen: npt.NDArray[np.bool_]


def pushed(linear: Linearization, columns: Floats) -> Pushed:
    """Tell how signatures, (rows, k), push what is left."""
    whole = np.einsum("ij,ij->j", columns, columns)
    inside, hidden = linear.nuisances.inside(columns)
    energy = whole - np.einsum("ij,ij->j", inside, hidden)
    push = columns.T @ linear.left[: len(columns)]
    seen = (energy > 1e-9 * np.maximum(whole, 1.0)) & (energy >= 1e-6)
    amplitude = np.where(seen, push, 0.0) / np.where(seen, energy, 1.0)
    gain = 0.5 * energy * np.maximum(amplitude, 0.0) ** 2
    return Pushed(hidden, whole, energy, amplitude, gain, seen)


def directions(linear: Linearization, columns: Floats) -> Floats:
    """Return signatures, (rows, k), off the nuisances, each of length one or zero."""
    off = linear.nuisances.off(columns)
    length = np.sqrt(np.einsum("ij,ij->j", off, off))
    return np.asarray(off / np.where(length > 0.0, length, 1.0))


def different(directions: Floats, most: int) -> list[int]:
    """Return indices of the first signatures, (rows, k), that are unlike all before them."""
    found: list[int] = []
    for i, one in enumerate(directions.T):
        if len(found) < most and np.all(np.abs(directions[:, found].T @ one) < ALIKE):
            found.append(i)
    return found


def batches(linear: Linearization, tried: Sequence[Tries]) -> Iterator[Sequence[Tries]]:
    """Yield as many at a time as have room, signatures of all recordings each."""
    count = min(BATCH, max(LARGEST // len(linear.groups), 1))
    for first in range(0, len(tried), count):
        yield tried[first : first + count]

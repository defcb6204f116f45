"""Changes of all outputs by effects, cached for screenings at other fits of the same recordings."""

from dataclasses import dataclass, field

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.linearization import Changes
from slipbench.identification.mismatch.simulation.model import Series

OF_EACH = 8
"""Largest number of cached candidates of one effect."""

Credit = tuple[float, float]


@dataclass(eq=False)
class Traces:
    """Changes of outputs by candidate, the best of each effect; in single precision.

    room: number of further changes that can be stored. Changes that are not stored are simulated
    again.
    """

    room: int = 0
    _kept: dict[str, list[tuple[Credit, Candidate, Changes]]] = field(default_factory=dict)

    def add(self, candidate: Candidate, credit: Credit, change: Series) -> None:
        """Store a change (T, m) unless enough of the same effect have more credit."""
        stored = self._kept.get(candidate.name, [])
        if len(stored) == OF_EACH and credit <= stored[-1][0]:
            return
        if len(stored) < OF_EACH:
            if not self.room:
                return
            self.room -= 1
        compact: Changes = [[np.asarray(one, np.float32) for one in group] for group in change]
        stored.append((credit, candidate, compact))
        stored.sort(key=lambda t: t[0], reverse=True)
        self._kept[candidate.name] = stored[:OF_EACH]

    def names(self) -> set[str]:
        """Names of the effects with stored changes."""
        return set(self._kept)

    def candidates(self) -> list[tuple[Candidate, Changes]]:
        """Candidates with their changes of the outputs, the best of each effect first.

        Changes: (T, m) by output group and record; empty where nothing changes.
        """
        return [(one, change) for stored in self._kept.values() for _, one, change in stored]

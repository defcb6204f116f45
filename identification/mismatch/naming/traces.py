"""What effects change in all outputs, kept to judge them in other fits of the same recordings."""

from dataclasses import dataclass, field

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.linearization import Changes
from slipbench.identification.mismatch.simulation.model import Series

OF_EACH = 8
"""Tries of one effect that are kept."""

Credit = tuple[float, float]


@dataclass(eq=False)
class Traces:
    """Changes of outputs by candidate, the best of each effect; in single precision.

    room: how many may be kept. What finds no room is missing, and is simulated again.
    """

    room: int = 0
    _kept: dict[str, list[tuple[Credit, Candidate, Changes]]] = field(default_factory=dict)

    def add(self, candidate: Candidate, credit: Credit, change: Series) -> None:
        """Keep a change unless as many of the same effect have more credit."""
        tries = self._kept.get(candidate.name, [])
        if len(tries) == OF_EACH and credit <= tries[-1][0]:
            return
        if len(tries) < OF_EACH:
            if not self.room:
                return
            self.room -= 1
        small: Changes = [[np.asarray(one, np.float32) for one in block] for block in change]
        tries.append((credit, candidate, small))
        tries.sort(key=lambda t: t[0], reverse=True)
        self._kept[candidate.name] = tries[:OF_EACH]

    def names(self) -> set[str]:
        """Names of the effects of which something is kept."""
        return set(self._kept)

    def tries(self) -> list[tuple[Candidate, Changes]]:
        """Candidates with the changes that they brought, of each effect the best first."""
        return [(one, change) for tries in self._kept.values() for _, one, change in tries]

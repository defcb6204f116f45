"""Settings of a check: number of simulated sets of recordings, seed and time limit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from slipbench.identification.mismatch.predictive_check.stopwatch import seconds
from slipbench.plant.effects.effect import Effect

COUNT, SEED = 10, 1


@dataclass(frozen=True)
class Order:
    """Settings of a check. count: simulated sets with effects, and as many without.

    limit: of the wall time, s; None: none. library: candidate effects; None: all. clock: s.
    """

    count: int = COUNT
    seed: int = SEED
    limit: float | None = None
    library: Sequence[type[Effect]] | None = None
    clock: Callable[[], float] = seconds

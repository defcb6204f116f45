"""What a check has to do: how many simulated sets of recordings, in which time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from slipbench.identification.mismatch.predictive_check.stopwatch import seconds
from slipbench.plant.effects.effect import Effect

COUNT, SEED = 10, 1


@dataclass(frozen=True)
class Order:
    """What is to be checked. count: simulated sets of recordings of each kind.

    limit: of the wall time, s; None: none. library: effects to look for; None: all. clock: s.
    """

    count: int = COUNT
    seed: int = SEED
    limit: float | None = None
    library: Sequence[type[Effect]] | None = None
    clock: Callable[[], float] = seconds

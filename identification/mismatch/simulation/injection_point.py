"""Where something may act: a place, and what a push there is."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class InjectionPoint:
    """A place. subsystem: where it acts; size: of a push worth trying, in its unit, SI.

    inputs: inputs of the simulation and their size per unit; its system makes columns of them. None
    means a sensor, which answers by itself, at once. negligible: share of the size below which nothing
    that acts there is of any interest.
    """

    name: str
    block: str
    unit: str
    size: float
    subsystem: str
    inputs: Mapping[str, float] = field(default_factory=dict)
    negligible: float = 0.02

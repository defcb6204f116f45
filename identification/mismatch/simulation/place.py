"""Where something may act: a place, and what a push there is."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Injection:
    """A place. drive: where it acts; size: of a push worth trying, in its unit, SI.

    push: inputs of the simulation and their size per unit; its system makes columns of them. None
    means a sensor, which answers by itself, at once. counts: share of the size below which nothing
    that acts there is of any interest.
    """

    name: str
    block: str
    unit: str
    size: float
    drive: str
    push: Mapping[str, float] = field(default_factory=dict)
    counts: float = 0.02

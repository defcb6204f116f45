"""The parameters of an effect as dials: sizes in shares of the typical one, shapes as unit normals.

0 is absent, 1 typical. Effects that limit (absent at infinity) grow as their limit falls: size =
typical / limit. Parameters that only shape an effect keep near their typical value.
"""

import math

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import Parameter

LARGE = 3.0
"""Largest share of the typical size at which every effect is tried."""
STEPS = (1.25, 1.6, 2.2)
"""Further shares of the typical size at which limits are tried."""
SHAPE = math.log(1.6)
"""Prior deviation of a shaping parameter's logarithm."""


def sizes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that size the effect."""
    return [p for p in kind.parameters() if p.sized]


def shapes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that shape it, as far as recordings can tell them."""
    return [p for p in kind.parameters() if not (p.sized or p.whole or p.given)]


def integer_parameters(kind: type[Effect]) -> list[Parameter]:
    """Parameters that are whole numbers."""
    return [p for p in kind.parameters() if not p.sized and p.whole]


def smallest(kind: type[Effect]) -> float:
    """Least size of interest of an effect, in shares of its typical size."""
    p = sizes(kind)[0]
    return as_size(p, p.typical if p.smallest is None else p.smallest)


def limits(kind: type[Effect]) -> bool:
    """Tell whether an effect limits: absent at infinity."""
    return math.isinf(sizes(kind)[0].absent)


def trial_sizes(kind: type[Effect]) -> tuple[float, ...]:
    """Sizes at which an effect is tried, smallest first.

    A limit does nothing until it is reached and then very much, so it is tried in smaller steps.
    """
    between = STEPS if limits(kind) else ()
    return (smallest(kind), 1.0, *between, LARGE)


def reach(kind: type[Effect]) -> tuple[float, float]:
    """Return the sizes, in shares of the typical one, between which its parameters mean anything.

    An effect of several sizes ends where the first of them does.
    """
    ends = [sorted(as_size(p, end) for end in (p.low, p.high)) for p in sizes(kind)]
    return max(low for low, _ in ends), min(high for _, high in ends)


def as_size(p: Parameter, value: float) -> float:
    """Return a value in shares of the typical size."""
    if math.isinf(p.absent):
        return p.typical / value if value > 0.0 else math.inf
    return (value - p.absent) / (p.typical - p.absent)


def sized(p: Parameter, size: float) -> float:
    """Return the value of a share of the typical size."""
    if math.isinf(p.absent):
        return p.typical / max(size, 1e-6)
    return p.absent + size * (p.typical - p.absent)


def shaped(p: Parameter, at: float, y: float) -> float:
    """Return a shape y prior deviations from where it is looked for."""
    if p.sought is not None:
        return at + y * p.sought[2]
    if by_factors(p, at):
        return at * math.exp(SHAPE * y)
    return at + y * (p.high - p.low) / 8.0


def as_shape(p: Parameter, at: float, value: float) -> float:
    """Return how many prior deviations a value lies from where it is looked for."""
    if p.sought is not None:
        return (value - at) / p.sought[2]
    if by_factors(p, at):
        return math.log(value / at) / SHAPE
    return (value - at) * 8.0 / (p.high - p.low)


def shape_range(p: Parameter, at: float) -> tuple[float, float]:
    """Return between how many prior deviations a shape means anything."""
    low = -math.inf if by_factors(p, at) and p.low == 0.0 else as_shape(p, at, p.low)
    return low, as_shape(p, at, p.high)


def by_factors(p: Parameter, at: float) -> bool:
    """Tell whether a shape is turned by factors, so that a share of it means something."""
    return p.sought is None and at > 0.0 and p.low >= 0.0


def inside(p: Parameter, value: float) -> float:
    """Return the value that is nearest within the parameter's range."""
    return float(min(max(value, p.low), p.high))

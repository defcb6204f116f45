"""Scaling of effect parameters: sizes in shares of the typical one, shapes as unit normals.

Size 0 is absent, 1 typical. Effects that limit (absent at infinity) grow as their limit falls: size
= typical / limit. Parameters that only shape an effect have a prior around their typical value.
"""

import math

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import Parameter

LARGE = 3.0
"""Largest trial size of every effect, in typical sizes."""
STEPS = (1.25, 1.6, 2.2)
"""Further trial sizes of limits, in typical sizes."""
SHAPE = math.log(1.6)
"""Prior deviation of the logarithm of a shape parameter."""


def sizes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that determine the size of the effect."""
    return [p for p in kind.parameters() if p.sized]


def shapes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that determine its shape and can be identified from recordings."""
    return [p for p in kind.parameters() if not (p.sized or p.whole or p.given)]


def integer_parameters(kind: type[Effect]) -> list[Parameter]:
    """Integer parameters."""
    return [p for p in kind.parameters() if not p.sized and p.whole]


def smallest(kind: type[Effect]) -> float:
    """Smallest size of interest of an effect, in typical sizes."""
    p = sizes(kind)[0]
    return as_size(p, p.typical if p.smallest is None else p.smallest)


def limits(kind: type[Effect]) -> bool:
    """Return whether an effect is a limit: absent at infinity."""
    return math.isinf(sizes(kind)[0].absent)


def trial_sizes(kind: type[Effect]) -> tuple[float, ...]:
    """Sizes at which an effect is tested, smallest first.

    A limit has no response until it is reached, and then a large one, so it is tested in smaller
    steps.
    """
    further = STEPS if limits(kind) else ()
    return (smallest(kind), 1.0, *further, LARGE)


def size_range(kind: type[Effect]) -> tuple[float, float]:
    """Return the range of valid sizes, in typical sizes.

    With several size parameters, the narrowest range.
    """
    ranges = [sorted(as_size(p, bound) for bound in (p.low, p.high)) for p in sizes(kind)]
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def as_size(p: Parameter, value: float) -> float:
    """Return the size, in typical sizes, of a parameter value."""
    if math.isinf(p.absent):
        return p.typical / value if value > 0.0 else math.inf
    return (value - p.absent) / (p.typical - p.absent)


def sized(p: Parameter, size: float) -> float:
    """Return the parameter value of a size, in typical sizes."""
    if math.isinf(p.absent):
        return p.typical / max(size, 1e-6)
    return p.absent + size * (p.typical - p.absent)


def shaped(p: Parameter, nominal: float, deviation: float) -> float:
    """Return the value of a shape parameter `deviation` prior deviations from the nominal one."""
    if p.sought:
        return nominal + deviation * spacing(p, nominal)
    if is_log_scaled(p, nominal):
        return nominal * math.exp(SHAPE * deviation)
    return nominal + deviation * (p.high - p.low) / 8.0


def as_shape(p: Parameter, nominal: float, value: float) -> float:
    """Return the distance of a value from the nominal one, in prior deviations."""
    if p.sought:
        return (value - nominal) / spacing(p, nominal)
    if is_log_scaled(p, nominal):
        return math.log(value / nominal) / SHAPE
    return (value - nominal) * 8.0 / (p.high - p.low)


def shape_range(p: Parameter, nominal: float) -> tuple[float, float]:
    """Return the valid range of a shape parameter, in prior deviations."""
    low = -math.inf if is_log_scaled(p, nominal) and p.low == 0.0 else as_shape(p, nominal, p.low)
    return low, as_shape(p, nominal, p.high)


def spacing(p: Parameter, at: float) -> float:
    """Return the distance of the values at which a parameter is sought, near one of them."""
    return float(np.interp(at, p.sought, np.gradient(p.sought)))


def is_log_scaled(p: Parameter, nominal: float) -> bool:
    """Return whether a shape parameter varies by factors, so that its logarithm is normal."""
    return not p.sought and nominal > 0.0 and p.low >= 0.0


def clipped(p: Parameter, value: float) -> float:
    """Return the nearest value within the parameter's range."""
    return float(min(max(value, p.low), p.high))
